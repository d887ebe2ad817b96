#include "libsurf/base/vtk_xml.h"

#include <gtest/gtest.h>

#include <string>

#include "libsurf/base/error.h"

namespace surf {
namespace {

std::string file_with(const std::string& field_data) {
  return "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><FieldData>" +
         field_data + "</FieldData><Piece NumberOfPoints=\"4\"></Piece></PolyData></VTKFile>";
}

TEST(VtkXml, FieldDataAreArraysOfATypeThatVtkKnows) {
  for (const char* known :
       {"", "<Array type=\"String\" Name=\"SPACE\"/>",
        "<DataArray type=\"Float64\"><InformationKey name=\"a\"/></DataArray><!-- none -->"})
    EXPECT_NO_THROW(check_vtk_xml("a.vtp", file_with(known))) << known;
  for (const char* unknown : {"<Array type=\"S*ring\" Name=\"SPACE\"/>", "<Array/>", "<Other/>"})
    EXPECT_THROW(check_vtk_xml("a.vtp", file_with(unknown)), InputError) << unknown;
}

TEST(VtkXml, CountsAreBelievedAsFarAsTheFileGoes) {
  EXPECT_NO_THROW(check_vtk_xml("a.vtp", "<!-- don't > --><Piece NumberOfPoints=\" +4 \">"));
  for (const char* piece :
       {"NumberOfPoints=\"1000000000\"", "NumberOfPolys=\"+9223372036854775807\"",
        "Name=\">\" NumberOfPolys=\"9223372036854775807\"",
        "NumberOfPolys=\"&#57;223372036854775807\"", "NumberOfComponents='+2000000000'",
        "NumberOfPoints=\"4x\"", "NumberOfPoints=\"4 nan\"", "NumberOfPoints=\"++4\""})
    EXPECT_THROW(check_vtk_xml("a.vtp", "<Piece " + std::string(piece) + ">"), InputError) << piece;
  const std::string large = "<Piece NumberOfPolys=\"9223372036854775807\">";
  for (const std::string before :
       {"<?xml version=\"1.0\"?><?x '?>", "<![CDATA[ ' ]]>", "<!--><AppendedData>-->",
        "<!DOCTYPE a [<!ENTITY b \"'\">]>", "<Piece Name='>"})
    EXPECT_THROW(check_vtk_xml("a.vtp", before + large), InputError) << before;
}

TEST(VtkXml, AppendedDataBeginWithTheirMark) {
  const std::string begin =
      "<VTKFile header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\">"
      "<DataArray format=\"appended\" offset=\"0\"/><AppendedData encoding=\"base64\">\n ";
  EXPECT_NO_THROW(check_vtk_xml("a.vti", begin + "_AAAAAA==</AppendedData></VTKFile>"));
  EXPECT_THROW(check_vtk_xml("a.vti", begin + "AAAAAA==</AppendedData></VTKFile>"), InputError);
  // As many blocks as its first word says, of which there is none.
  EXPECT_THROW(check_vtk_xml("a.vti", begin + "_iIiIiIiIiIiIiIiIiIiI</AppendedData></VTKFile>"),
               InputError);
}

}  // namespace
}  // namespace surf
