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
  EXPECT_THROW(check_vtk_xml("a.vtp", "<Piece NumberOfPoints=\"1000000000\">"), InputError);
}

}  // namespace
}  // namespace surf
