// Every wrong file and value: its exit code, one line that says what is wrong, and nothing left.
#include <nifti/nifti1.h>

#include <array>
#include <cstring>
#include <limits>

#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/volume/write_volume.h"
#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

/// A good volume and seed, and what is wrong about the run.
Words segment(const Words& wrong) {
  return joined({"segment", "good.nii", "--seed", "0,0,0", "-o", "out.stl"}, wrong);
}
Words volume(const char* name) { return {"segment", name, "--seed", "0,0,0", "-o", "out.stl"}; }
Words seed(const char* value) { return {"segment", "good.nii", "--seed", value, "-o", "out.stl"}; }
Words output(const char* name) { return {"segment", "good.nii", "--seed", "0,0,0", "-o", name}; }
Words initial(const char* option, const char* value) {
  return {"segment", "good.nii", option, value, "-o", "out.stl", "--energy", "minimal-surface"};
}
Words evaluate(const Words& rest) { return joined({"evaluate", "ball.stl"}, rest); }
Words render(const Words& rest) {
  return joined({"render", "ball.stl", "--volume", "good.nii"}, rest);
}
Words phantom(const Words& rest) { return joined({"phantom", "ball", "-o", "out.nii.gz"}, rest); }

const std::vector<Row> kRows = {
    // Volumes.
    {"NoVolume", {"segment", "--seed", "0,0,0", "-o", "out.stl"}, 2, "a volume is missing"},
    {"VolumeMissing", volume("gone.nii"), 3, "gone.nii: cannot be read"},
    {"FolderWithoutDicom", volume("folder"), 3, "no DICOM image"},
    {"TextAsNifti", volume("text.nii.gz"), 3, "text.nii.gz: "},
    {"TextFile", volume("text.txt"), 3, "not a volume"},
    {"EmptyFile", volume("empty.nii"), 3, "is empty"},
    {"Truncated", volume("cut.nii"), 3, "truncated"},
    {"TruncatedGzip", volume("cut.nii.gz"), 3, "truncated"},
    {"HeaderOnly", volume("header.nii"), 3, "truncated"},
    {"NanVoxel", volume("nan.nii"), 3, "is NaN"},
    {"ZeroSpacing", volume("spacing.nii"), 3, "zero voxel spacing"},
    {"SingularMatrix", volume("singular.nii"), 3, "singular"},
    {"Plane", volume("plane.nii"), 3, "at least 2 along every axis"},
    {"BeyondMemory", volume("huge.nii"), 3, "this machine has"},
    {"FrameBeyondEnd", segment({"--frame-index", "7"}), 3, "frame"},
    {"BlurBeyondTheImage", segment({"--sigma", "1e10mm"}), 2, "--sigma = 1e+10 mm is wider"},
    {"SelectiveBlurBeyondTheImage",
     segment({"--selective-sigma", "3000mm", "--selective-threshold", "1"}), 2, "is wider than"},
    {"AutoBesideAnEnergy", segment({"--energy", "auto", "--energy", "area:weight=1"}), 2,
     "--energy: auto finds"},
    {"DecimalComma", seed("1,5,2,3,4"), 2, "decimals are written with a point"},
    {"FrameNegative", segment({"--frame-index", "-1"}), 2, "--frame-index: expected 0 or more"},
    {"InfoMissing", {"info", "gone.nii"}, 3, "gone.nii: cannot be read"},
    {"InfoFolder", {"info", "folder"}, 3, "no DICOM image"},
    {"InfoText", {"info", "text.txt"}, 3, "not a volume"},
    {"InfoNan", {"info", "nan.nii"}, 3, "is NaN"},
    {"InfoNothing", {"info"}, 2, "FILE"},
    // Outputs.
    {"NoOutput", {"segment", "good.nii", "--seed", "0,0,0"}, 2, "-o: an output file is missing"},
    {"OutputEnding", output("out.xyz"), 2, "-o: out.xyz: expected a name that ends in .stl"},
    {"OutputWithoutEnding", output("out"), 2, "ends in .stl"},
    {"OutputFolderMissing", output("no/out.stl"), 4, "the folder no does not exist"},
    {"OutputIsFolder", output("folder.stl"), 4, "is a folder"},
    {"OutputFolderReadOnly", output("/proc/out.stl"), 4, "/proc/out.stl: cannot be written"},
    {"MaskEnding", segment({"--mask", "mask.png"}), 2, "--mask: mask.png: expected a name"},
    {"MaskFolderMissing", segment({"--mask", "no/mask.nii"}), 4, "--mask: no/mask.nii: the folder"},
    {"MaskOfEach", segment({"--mask", "{object}.nii"}), 2,
     "--mask: {object}.nii: one file tells of all objects"},
    {"MaskIsVolume", segment({"--mask", "good.nii"}), 2, "is the input too"},
    {"JsonFolderMissing", segment({"--json", "no/s.json"}), 4, "--json: no/s.json: the folder no"},
    {"JsonIsOutput", segment({"--json", "out.stl"}), 2, "is -o too"},
    {"OutputSpace", segment({"--output-space", "ijk"}), 2, "--output-space"},
    // Seeds and initial surfaces.
    {"NoSeed", {"segment", "good.nii", "-o", "out.stl"}, 2, "--seed: at least one point"},
    {"SeedOfTwo", seed("1,2"), 2, "--seed: expected three numbers X,Y,Z; got '1,2'"},
    {"SeedOfLetters", seed("a,b,c"), 2, "got 'a,b,c'"},
    {"SeedOfFour", seed("1,2,3,4"), 2, "got '1,2,3,4'"},
    {"SeedNan", seed("nan,0,0"), 2, "got 'nan,0,0'"},
    {"SeedOutside", seed("500,0,0"), 2, "outside the volume of 16 x 16 x 16 voxels"},
    {"SeedOfOtherSpace", segment({"--space", "ijk", "--seed", "-5,3,3"}), 2, "(--space)"},
    {"BoxOfFive", segment({"--box", "1,2,3,4,5"}), 2,
     "--box: expected 6 numbers X,Y,Z,X,Y,Z; got '1,2,3,4,5'"},
    {"BoxOfNoVoxel", segment({"--box", "90,90,90,99,99,99"}), 2, "holds no voxel"},
    {"BoxOfOtherSpace", segment({"--box", "90,90,90,99,99,99"}), 2, "(--space)"},
    {"BoxThin", segment({"--box", "-5,-5,0,5,5,0"}), 2, "only 2 voxels thick along axis k"},
    {"BoxWithoutTheSeed", segment({"--box", "2,2,2,7,7,7"}), 2,
     "--box: the inside click (0, 0, 0) mm is outside the box"},
    {"OutsideOfTwo", segment({"--outside", "1,2"}), 2, "--outside: expected three numbers X,Y,Z"},
    {"OutsideBeyondTheVolume", segment({"--outside", "500,0,0"}), 2,
     "--outside: (500, 0, 0) mm is"},
    {"OutsideOfOtherSpace", segment({"--outside", "0,500,0"}), 2, "(--space)"},
    {"OutsideInTheSeedsVoxel", segment({"--outside", "0.1,0,0"}), 2,
     "--outside: (0.1, 0, 0) mm is in the same voxel as an inside click"},
    {"OutsideWithoutSeed",
     {"segment", "good.nii", "--outside", "3,0,0", "-o", "out.stl"},
     2,
     "--seed: at least one point"},
    {"SpaceUnknown", segment({"--space", "mni"}), 2, "--space: mni not in"},
    {"InitialMissing", initial("--initial", "gone.stl"), 3, "gone.stl"},
    {"InitialOpen", initial("--initial", "open.stl"), 3, "3 border edges"},
    {"InitialBroken", initial("--initial", "broken.stl"), 3, "broken.stl"},
    {"InitialWithoutLabel", initial("--initial", "zeros.nii"), 3, "no voxel has the label 1"},
    {"InitialElsewhere", initial("--initial-ball", "900,0,0,3mm"), 3, "lies in the volume"},
    {"InitialBallUnit", initial("--initial-ball", "0,0,0,3"), 2, "a length with its unit"},
    {"InitialBallOfThree", initial("--initial-ball", "0,0,3mm"), 2, "X,Y,Z,RADIUS"},
    {"InitialEllipsoid", initial("--initial-ellipsoid", "0,0,0,3mm"), 2, "X,Y,Z,A,B,C"},
    {"InitialBoxFlat", initial("--initial-box", "0,0,0,4,4,0"), 2, "must differ in all three"},
    {"InitialTwice", segment({"--initial", "ball.stl", "--initial-ball", "0,0,0,3mm"}), 2,
     "give one of them"},
    // Lengths and numbers.
    {"RadiusWithoutUnit", segment({"--radius", "12"}), 2,
     "--radius: expected a length with its unit, such as 12mm or 20vox; got '12'"},
    {"RadiusNegative", segment({"--radius", "-3mm"}), 2, "cannot be negative; got '-3mm'"},
    {"RadiusZero", segment({"--radius", "0mm"}), 2, "--radius: a length must be positive"},
    {"RadiusInCm", segment({"--radius", "2cm"}), 2, "got '2cm'"},
    {"LevelsZero", segment({"--levels", "0"}), 2, "--levels: expected"},
    {"CoarsenessBelowOne", segment({"--coarseness", "0.5"}), 2, "--coarseness: expected"},
    {"GeometryToleranceZero", segment({"--geometry-tolerance", "0mm"}), 2,
     "--geometry-tolerance: a length must be"},
    {"GeometryToleranceWithoutUnit", segment({"--geometry-tolerance", "1"}), 2,
     "--geometry-tolerance"},
    {"IntegralToleranceNegative", segment({"--integral-tolerance", "-1"}), 2,
     "--integral-tolerance: expected"},
    {"EdgeLengthZero", segment({"--edge-length", "0vox"}), 2, "--edge-length: a length must be"},
    {"SigmaWithoutUnit", segment({"--sigma", "1"}), 2, "--sigma: expected a length"},
    {"SigmaWithoutValue", segment({"--sigma"}), 2, "--sigma"},
    {"IterationsNegative", segment({"--max-iterations", "-1"}), 2,
     "--max-iterations: expected 0 or more; got -1"},
    {"IterationsText", segment({"--max-iterations", "many"}), 2, "--max-iterations"},
    {"ToleranceTwo", segment({"--tolerance", "2"}), 2, "--tolerance: expected a number from 0"},
    {"ToleranceNan", segment({"--tolerance", "nan"}), 2, "--tolerance: expected a number from 0"},
    {"AlphaAboveBeta", segment({"--alpha", "0.9"}), 2, "--alpha = 0.9, beta = 0.75 violate"},
    {"EpsilonTauZero", segment({"--epsilon-tau", "0"}), 2, "--epsilon-tau = 0 violates > 0"},
    {"TauMinAboveMax", segment({"--tau-min", "2", "--tau-max", "1"}), 2, "--tau-max = 1 violates"},
    {"TauMaxOfNewton",
     segment(
         {"--flow", "newton", "--energy", "area", "--tau-max", "1", "--initial-ball", "0,0,0,3mm"}),
     2, "--tau-max: it belongs to the flows h1, l2 and h-1"},
    {"GammaCoarsenAboveRefine", segment({"--gamma-coarsen", "0.8"}), 2,
     "--gamma-refine = 0.7, gamma_coarsen = 0.8 violate"},
    {"ThreadsNegative", segment({"--threads", "-1"}), 2, "--threads: expected 0 (all) or more"},
    {"FlowUnknown", segment({"--flow", "l3"}), 2, "--flow: l3 not in"},
    {"SchemeUnknown", segment({"--scheme", "magic"}), 2, "--scheme: magic not in"},
    // Energies.
    {"EnergyUnknown", segment({"--energy", "foo"}), 2, "energy 'foo' is unknown; there are"},
    {"EnergyParameter", segment({"--energy", "window:widht=3"}), 2, "parameter 'widht' is unknown"},
    {"EnergyWithoutValue", segment({"--energy", "window:mean"}), 2, "expected key=value"},
    {"EnergyText", segment({"--energy", "window:mean=x"}), 2, "expected a number; got 'x'"},
    {"EnergyWidth", segment({"--energy", "window:half-width=-1"}), 2, "violates > 0"},
    {"LambdaText", segment({"--lambda", "foo"}), 2, "--lambda: expected a number; got 'foo'"},
    {"LambdaZero", segment({"--lambda", "0"}), 2, "lambda = 0 violates > 0"},
    {"GammaUnused", segment({"--energy", "chan-vese", "--gamma", "-1"}), 2,
     "they belong to --energy minimal-surface"},
    // The command line and --config.
    {"NoVerb", {}, 2, "subcommand is required"},
    {"VerbUnknown", {"segmnet"}, 2, "'segmnet' is neither a command nor an option"},
    {"VerbNearlyKnown", {"segmnet"}, 2, "did you mean 'segment'?"},
    {"OptionUnknown", segment({"--foo"}), 2, "--foo is not an option (see surfseg segment --help)"},
    {"OptionNearlyKnown", segment({"--raduis", "3mm"}), 2,
     "--raduis is not an option; did you mean '--radius'? (see surfseg segment --help)"},
    {"OptionNearlyKnownWithEqual", segment({"--raduis=3mm"}), 2, "did you mean '--radius'?"},
    {"OptionWithOneDash", segment({"-sed=1,2,3"}), 2, "did you mean '--seed'?"},
    {"OptionMissingBecauseMistyped",
     {"evaluate", "ball.stl", "--refrence", "ball.stl"},
     2,
     "did you mean '--reference'?"},
    {"OptionTwice", segment({"--flow", "l2", "--flow", "h1"}), 2, "--flow"},
    {"ConfigMissing", segment({"--config", "gone.json"}), 3, "gone.json: cannot be read"},
    {"ConfigNoJson", segment({"--config", "text.txt"}), 3, "text.txt: not valid JSON"},
    {"ConfigList", segment({"--config", "list.json"}), 2, "expected an object of options"},
    {"ConfigKey", segment({"--config", "key.json"}), 2, "'radios' is not an option of segment"},
    {"ConfigKeyNearlyKnown", segment({"--config", "key.json"}), 2, "did you mean 'radius'?"},
    {"PresetUnknown", segment({"--preset", "femur"}), 2, "preset 'femur' is unknown; there are"},
    {"PresetNearlyKnown", segment({"--preset", "kidny-ct"}), 2, "did you mean 'kidney-ct'?"},
    {"SeriesOfFile", segment({"--series-uid", "1.2"}), 2,
     "--series-uid: good.nii is no DICOM image"},
    {"OptionsUnknown", segment({"--quick", "--zebra"}), 2, "--quick is not an option (see"},
    {"SeriesOfNoDicom", {"info", "folder", "--series-uid", "1.2"}, 3, "no DICOM image"},
    {"ConfigType", segment({"--config", "type.json"}), 2, "type.json: 'radius' is {\"mm\":3}"},
    {"ConfigNumber", segment({"--config", "number.json"}), 2, "number.json: 'threads' is \"few\""},
    {"ConfigValue", segment({"--config", "value.json"}), 2, "--radius: expected a length"},
    {"MinComponent", segment({"--min-component", "-1"}), 2, "--min-component: expected a volume"},
    {"MinComponentUnit", segment({"--min-component", "5mm2"}), 2,
     "--min-component: expected a volume"},
    {"Keep", segment({"--keep", "some"}), 2, "--keep"},
    {"KeepSeeded",
     {"segment", "good.nii", "--initial", "ball.stl", "--energy", "area", "--keep", "seeded", "-o",
      "out.stl"},
     2,
     "--keep seeded: a --seed"},
    // evaluate.
    {"NoReference", evaluate({}), 2, "--reference"},
    {"ReferenceMissing", evaluate({"--reference", "gone.ply"}), 3, "gone.ply"},
    {"ReferenceLabel", evaluate({"--reference", "zeros.nii", "--label", "9"}), 3, "label 9"},
    {"ReferenceMeshLabel", evaluate({"--reference", "ball.stl", "--label", "1"}), 2, "no labels"},
    {"ReferenceMeshFrame", evaluate({"--reference", "ball.stl", "--frame-index", "3"}), 2,
     "--frame-index: ball.stl is a mesh, not a volume"},
    {"ReferenceMeshSeries", evaluate({"--reference", "ball.stl", "--series-uid", "1.2"}), 2,
     "--series-uid: ball.stl is a mesh, not a volume"},
    {"ReferenceOfNoObject", segment({"--reference", "{object}.nii"}), 2,
     "--reference: {object}.nii: there is no --object to name"},
    {"ReferenceOfObjectMissing",
     {"segment", "good.nii", "--object", "good", "--seed", "0,0,0", "--object", "gone", "--seed",
      "2,0,0", "-o", "{object}.stl", "--reference", "{object}.nii"},
     3,
     "--reference: gone.nii: there is no such file"},
    {"LabelText", evaluate({"--reference", "zeros.nii", "--label", "x"}), 2, "--label"},
    {"SurfaceBroken", {"evaluate", "broken.stl", "--reference", "ball.stl"}, 3, "broken.stl"},
    {"SurfaceText", {"evaluate", "text.txt", "--reference", "ball.stl"}, 3, "text.txt"},
    {"EvaluateJson", evaluate({"--reference", "ball.stl", "--json", "no/s.json"}), 4, "folder no"},
    // render and --picture.
    {"RenderEnding", render({"-o", "out.jpg"}), 2, "--output: out.jpg: expected a name that ends"},
    {"RenderFolder", render({"-o", "no/out.png"}), 4, "the folder no does not exist"},
    {"RenderWindow", render({"-o", "o.png", "--window", "liver"}), 2,
     "--window: expected soft-tissue, bone, lung, brain or LOW,HIGH"},
    {"RenderWindowEmpty", render({"-o", "o.png", "--window", "3,3"}), 2,
     "--window: the first value must be less"},
    {"RenderSheet", render({"-o", "o.png", "--sheet", "4x"}), 2,
     "--sheet: expected a number of slices from 1 to 400, or COLUMNSxROWS"},
    {"RenderSheetTooLarge", render({"-o", "o.png", "--sheet", "40x30"}), 2, "--sheet = 1200"},
    {"RenderSheetAt", render({"-o", "o.png", "--sheet", "4", "--at", "0,0,0"}), 2,
     "--at: it belongs to three slices"},
    {"RenderSeed", render({"-o", "o.png", "--seed", "1,2"}), 2, "--seed: expected three numbers"},
    {"RenderSeedWithoutVolume",
     {"render", "ball.stl", "-o", "o.png", "--seed", "0,0,0"},
     2,
     "give --volume too"},
    {"RenderWidth", render({"-o", "o.png", "--width", "10"}), 2, "--width: expected 100 to 20000"},
    {"PictureEnding", segment({"--picture", "p.jpg"}), 2, "--picture: p.jpg: expected a name"},
    {"PictureFolder", segment({"--picture", "no/p.png"}), 4, "--picture: no/p.png: the folder no"},
    // phantom.
    {"PhantomKind", {"phantom", "cube", "-o", "out.nii"}, 2, "cube"},
    {"PhantomSize", phantom({"--size", "1"}), 2, "--size: expected N or NX,NY,NZ"},
    {"PhantomSizeText", phantom({"--size", "big"}), 2, "--size"},
    {"PhantomNoise", phantom({"--noise", "-0.1"}), 2, "--noise: expected 0 or more; got -0.1"},
    {"PhantomSpacing", phantom({"--spacing", "0"}), 2, "a spacing must be positive"},
    {"PhantomDirection", phantom({"--direction", "1,0,0,1,0,0,0,0,1"}), 2, "direction"},
    {"PhantomEnding", {"phantom", "ball", "-o", "out.png"}, 2, "-o: out.png: expected a name"},
    {"PhantomFolder", {"phantom", "ball", "-o", "no/out.nii"}, 4, "the folder no does not exist"},
};

class BadInput : public RowTest {
 protected:
  static constexpr std::array<int, 3> kSize = {16, 16, 16};

  BadInput() {
    const Eigen::Affine3d affine(Eigen::Translation3d(-7.5, -7.5, -7.5));
    std::vector<float> values;
    for (int n = 0; n < 16 * 16 * 16; ++n)
      values.push_back((affine * Eigen::Vector3d(n % 16, n / 16 % 16, n / 256)).norm() < 5 ? 1.0f
                                                                                           : 0.0f);
    surf::volume::write_volume(file("good.nii"), {kSize, affine, values});
    surf::volume::write_volume(file("cut.nii.gz"), {kSize, affine, values});
    put("cut.nii.gz", bytes("cut.nii.gz").substr(0, 200));
    values.assign(values.size(), 0.0f);
    surf::volume::write_volume(file("zeros.nii"), {kSize, affine, values});
    put_broken_volumes(bytes("good.nii"));
    put_surfaces();
    put("empty.nii", "");
    put("text.txt", "hello, world\n");
    put("text.nii.gz", "hello, world\n");
    std::filesystem::create_directories(file("folder"));
    std::filesystem::create_directories(file("folder.stl"));
    put("folder/readme.txt", "no slice");
    put("list.json", "[1, 2]");
    put("key.json", R"({"radios": "3mm"})");
    put("type.json", R"({"radius": {"mm": 3}})");
    put("number.json", R"({"threads": "few"})");
    put("value.json", R"({"radius": 3})");
  }

 private:
  template <class Change>
  void put_changed(const char* name, std::string bytes, const Change& change) const {
    nifti_1_header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    change(header);
    std::memcpy(bytes.data(), &header, sizeof header);
    put(name, bytes);
  }

  void put_broken_volumes(const std::string& good) const {
    put("cut.nii", good.substr(0, good.size() / 2));
    put("header.nii", good.substr(0, 352));
    std::string with_nan = good;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(with_nan.data() + 352 + 400, &nan, sizeof nan);
    put("nan.nii", with_nan);
    put_changed("spacing.nii", good, [](auto& h) {
      h.sform_code = h.qform_code = 0;
      h.pixdim[3] = 0;
    });
    put_changed("singular.nii", good, [](auto& h) { h.srow_x[1] = h.srow_y[0] = 1; });
    put_changed("plane.nii", good, [](auto& h) { h.dim[3] = 1; });
    put_changed("huge.nii", good, [](auto& h) { h.dim[1] = h.dim[2] = h.dim[3] = 32767; });
  }

  void put_surfaces() const {
    surf::Triangles ball = surf::mesh::ball({0, 0, 0}, 4, 2);
    surf::io::write_surface(file("ball.stl"), ball);
    ball.elements.conservativeResize(ball.elements.rows() - 1, 3);
    surf::io::write_surface(file("open.stl"), ball);
    put("broken.stl", bytes("ball.stl").substr(0, 500));
  }
};

TEST_P(BadInput, EndsInOneLineItsCodeAndNoFile) { expect_refusal("surfseg"); }

INSTANTIATE_TEST_SUITE_P(All, BadInput, ::testing::ValuesIn(kRows), name_of);

}  // namespace
}  // namespace surfseg::test
