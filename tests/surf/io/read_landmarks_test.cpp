#include "libsurf/io/read_landmarks.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "tests/surf/io/scratch_folder.h"

namespace surf::io {
namespace {

Eigen::MatrixXd expected() {
  Eigen::MatrixXd points(2, 3);
  points << 19.5, -13.25, 29, 7, 76.5, -1e1;
  return points;
}

struct ReadLandmarks : test::ScratchFolder {
  Landmarks landmarks(const std::string& name, const std::string& content) {
    return read_landmarks(write(name, content));
  }
  std::string message(const std::string& name, const std::string& content) {
    try {
      landmarks(name, content);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing thrown";
  }
};

const std::string kColumns = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc\n";
const std::string kLpsRows =
    "vtkMRML_1,-19.5,13.25,29,0,0,0,1,1,1,0,\"F, 1\",,\r\n1,-7,-76.5,-1e1,0,0,0,1,1,1,0,F-2,,\n";
const std::string kRasRows = "0,19.5,-13.25,29,0,0,0,1,1,1,0,F-1,,\n\n1,7,76.5,-10,0,0,0,1\n";

TEST_F(ReadLandmarks, BringsListsOfSlicerToRas) {
  const std::string version = "# Markups fiducial file version = 4.13\n";
  for (const std::string word : {"LPS", "1"}) {
    const Landmarks lps =
        landmarks("a.fcsv", version + "# CoordinateSystem = " + word + "\n" + kColumns + kLpsRows);
    EXPECT_TRUE(lps.is_ras);
    EXPECT_EQ(lps.points, expected());
  }
  for (const std::string line : {"# CoordinateSystem = RAS\n", "# CoordinateSystem = 0\n", ""})
    EXPECT_EQ(landmarks("b.fcsv", version + line + kColumns + kRasRows).points, expected());
}

TEST_F(ReadLandmarks, BringsMarkupsOfSlicerToRas) {
  const std::string points =
      R"("controlPoints": [{"label": "F-1", "position": [-19.5, 13.25, 29]},
         {"position": [0, 0, 0], "positionStatus": "undefined"},
         {"position": [-7, -76.5, -10], "positionStatus": "defined"}]}]})";
  for (const std::string start :
       {R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", )",
        R"({"markups": [{"coordinateUnits": "mm", )",
        R"({"markups": [{"coordinateUnits": ["mm", "UCUM", "millimeter"], )"}) {
    const Landmarks markups = landmarks("a.mrk.json", start + points);
    EXPECT_TRUE(markups.is_ras);
    EXPECT_EQ(markups.points, expected());
  }
  Eigen::MatrixXd as_they_are = expected();
  as_they_are.leftCols(2) *= -1;
  EXPECT_EQ(landmarks("a.mrk.json", R"({"markups": [{"coordinateSystem": "RAS", )" + points).points,
            as_they_are);
}

TEST_F(ReadLandmarks, TakesPlainTextAsItIsUnlessItStatesItsSpace) {
  const Landmarks plain = landmarks("a.txt", "# x y z\n19.5 -13.25\t29\n\n 7, 76.5; -1e1 \r\n");
  EXPECT_FALSE(plain.is_ras);
  EXPECT_EQ(plain.points, expected());
  const Landmarks lps = landmarks("a.csv", "# SPACE=LPS\n-19.5,13.25,29\n-7,-76.5,-10");
  EXPECT_TRUE(lps.is_ras);
  EXPECT_EQ(lps.points, expected());
  const Landmarks plane = landmarks("a.txt", "1 2\n3 4\n5 6\n");
  EXPECT_EQ(plane.points.cols(), 2);
  EXPECT_EQ(plane.points(2, 1), 6);
}

TEST_F(ReadLandmarks, SaysWhatIsWrong) {
  EXPECT_NE(message("a.txt", "1 2 3\n4 x 6\n").find(":2: expected a coordinate; got 'x'"),
            std::string::npos);
  EXPECT_NE(message("a.txt", "1 2 3\n4 5\n").find("as many in every line"), std::string::npos);
  EXPECT_NE(message("a.txt", "# nothing\n").find("no landmarks"), std::string::npos);
  EXPECT_NE(message("a.fcsv", "0,1,2\n").find(":1: expected id,x,y,z"), std::string::npos);
  EXPECT_NE(message("a.fcsv", "# CoordinateSystem = IJK\n").find("expected LPS or RAS"),
            std::string::npos);
  EXPECT_NE(message("a.fcsv", "0,1,2,nan\n").find("got 'nan'"), std::string::npos);
  EXPECT_NE(message("a.json", "{}").find("no markups file"), std::string::npos);
  EXPECT_NE(message("a.json", "{\"markups\": [").find("no markups file"), std::string::npos);
  EXPECT_NE(message("a.json", R"({"markups": [{"coordinateUnits": "um", "controlPoints": []}]})")
                .find("expected mm"),
            std::string::npos);
  EXPECT_THROW(read_landmarks(path("missing.fcsv")), InputError);
}

}  // namespace
}  // namespace surf::io
