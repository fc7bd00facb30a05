#include "tool_test_support.h"

#include <cmath>
#include <limits>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "support/data.h"

namespace vrpipe::testing {
namespace {

class BadInput : public ToolTest {
 protected:
  void SetUp() override {
    write("empty.ply", "");
    write("empty.spl", "");
    write("text.ply", "hello\n");
    write("text.spl", "hello, this is not a draw list");
    write("cut.spl", read_file(folder() / "tiny.spl").substr(0, 700));
    GaussianSceneBuilder builder(0);
    GaussianAttributes gaussian;
    gaussian.position = {0, 0, 5};
    gaussian.log_scale = {-1, -1, -1};
    gaussian.opacity_logit = 3;
    for (int i = 0; i < 4; ++i) builder.add(gaussian);
    write_gaussian_file(folder() / "good.ply", builder.build());
    std::string ply = read_file(folder() / "good.ply");
    write("cut.ply", ply.substr(0, ply.size() - 10));
    write("other.ply", ply.replace(ply.find("opacity"), 7, "opacitx"));
    write("cameras.json",
          R"([{"width": 64, "height": 48, "position": [0, 0, 0], "rotation": [[1,0,0],[0,1,0],[0,0,1]],
               "fx": 60, "fy": 60}])");
    write("broken.json", "[{");
    write("foreign.so", "not a plugin at all");
    write("words.so", std::string("\x7f"
                                  "ELF...vrpipe-plugin/0.0.0/itanium-abi") +
                          '\0' + "...");
    write("file", "neither Gaussians nor a mesh");
    write("junk.glb", "neither Gaussians nor a mesh");
    std::filesystem::create_directory(folder() / "folder.ply");
  }

  /// With every kind of output asked for, which must not appear.
  void refused_with_outputs(std::vector<std::string> arguments, const std::vector<std::string>& parts) {
    arguments.insert(arguments.end(), {"--output", "images/deep", "--json", "result.json", "--save-draw", "draw.spl"});
    refused(arguments, parts);
  }
};

TEST_F(BadInput, Commands) {
  refused({},
          {"no command",
           "run, compare, accuracy, sweep, reproduce, frames, microbench, convert, diff, scenes, platforms, units"});
  refused({"swep"}, {"'swep'", "did you mean sweep?"});
  refused({"simulate", "a.json", "b.json"}, {"'simulate'"});
  refused({"compar"}, {"'compar'", "did you mean compare?"});
  refused({"--scene", "tiny.spl"}, {"'--scene'", "after the command"});
}

TEST_F(BadInput, Options) {
  refused({"run", "--scen", "tiny.spl"}, {"'--scen'", "vrpipe run", "did you mean --scene?"});
  refused({"run", "--formt=rgba8"}, {"'--formt'", "did you mean --format?"});
  refused({"accuracy", "--trace", "t.json"}, {"'--trace'", "`vrpipe run`"});
  refused({"run", "-x"}, {"'-x'"});
  refused({"run", "extra"}, {"'extra'"});
  refused({"run", "--scene"}, {"missing value", "--scene"});
  refused({"run", "--scene", "--size", "8x8"}, {"missing value", "--scene", "--size"});
  refused({"run", "--output", ""}, {"missing value", "--output"});
  refused({"run", "--size", "8x8", "--size", "9x9"}, {"twice", "--size", "8x8", "9x9"});
  refused({"run", "--set", "tc.bins=1", "--set", "tc.bins=2"}, {"twice (--set tc.bins)", "'1'", "'2'"});
  refused({"run", "--unit", "qru=pairing", "--unit", "qru=pass-through"}, {"twice (--unit qru)", "'pairing'"});
  for (const char* flag : {"--quick=2", "--quick=false", "--markdown=1"}) {
    refused({"accuracy", flag}, {"unexpected value", "it is a switch"});
  }
  refused({"units", "--markdown=1"}, {"unexpected value (--markdown)", "it is a switch"});
}

TEST_F(BadInput, Numbers) {
  refused_with_outputs({"run", "--size", "0x8"}, {"--size", "0x8", "1 to 16384"});
  refused_with_outputs({"run", "--size", "8x0"}, {"--size", "8x0", "1 to 16384"});
  refused_with_outputs({"compare", "--size", "16385x8"}, {"16385x8", "16384"});
  refused_with_outputs({"run", "--size", "4294967297x1"}, {"4294967297x1", "16384"});
  for (const char* text : {"8", "8x", "x8", "8x8x8", "-8x8", "8.5x8", "8X8", "99999999999999999999x1"}) {
    refused_with_outputs({"run", "--size", text}, {text, "--size", "1280x720"});
  }
  refused_with_outputs({"run", "--eye", "1,2"}, {"--eye", "2 numbers", "X,Y,Z"});
  refused_with_outputs({"run", "--eye", "1,2,nan"}, {"--eye", "'nan'", "finite"});
  refused_with_outputs({"run", "--look-at", "1,2,3x"}, {"--look-at", "'3x'"});
  refused_with_outputs({"run", "--up", "1,,3"}, {"--up", "''"});
  refused_with_outputs({"run", "--eye", "1,1,1", "--look-at", "1,1,1"}, {"--look-at", "--eye"});
  refused_with_outputs({"run", "--fovy", "wide"}, {"--fovy", "'wide'"});
  refused_with_outputs({"run", "--fovy", "inf"}, {"--fovy", "'inf'"});
  refused_with_outputs({"run", "--fovy", "180"}, {"--fovy", "180"});
  refused_with_outputs({"run", "--fovy", "1e-300"}, {"--fovy", " 1e-300 degrees"});
  refused_with_outputs({"run", "--background", "255,255,255"}, {"--background", "255", "0 to 1"});
  refused_with_outputs({"run", "--background", "0,0"}, {"--background", "R,G,B"});
  refused({"compare", "--jobs", "0"}, {"--jobs", "'0'"});
}

TEST_F(BadInput, Scenes) {
  refused_with_outputs({"run", "--scene", "missing.ply"}, {"missing.ply", "no such file"});
  refused_with_outputs({"compare", "--scene", "missing.spl"}, {"missing.spl", "no such file"});
  refused_with_outputs({"run", "--scene", "empty.ply"}, {"empty.ply", "empty"});
  refused_with_outputs({"run", "--scene", "empty.spl"}, {"empty.spl", "empty"});
  refused_with_outputs({"run", "--scene", "text.ply"}, {"text.ply", "ply"});
  refused_with_outputs({"run", "--scene", "text.spl"}, {"text.spl", "--save-draw"});
  refused_with_outputs({"compare", "--scene", "cut.ply"}, {"cut.ply"});
  refused_with_outputs({"run", "--scene", "cut.spl"}, {"cut.spl", "60 splats"});
  refused_with_outputs({"run", "--scene", "other.ply"}, {"other.ply", "opacity"});
  refused_with_outputs({"run", "--scene", "missing.glb"}, {"missing.glb", "no such file"});
  for (const char* option : {"--scene", "--mesh"})
    refused_with_outputs({"run", option, "junk.glb"}, {"junk.glb", "it is no glTF"});
  refused_with_outputs({"run", "--scene", "folder.ply"}, {"folder.ply", "directory"});
  refused_with_outputs({"run", "--scene", "file"}, {"file", "known format", ".ply"});
  refused_with_outputs({"run", "--scene", "builtin:objekt"}, {"builtin:objekt", "object"});
  refused_with_outputs({"run", "--scene", "tiny.spl", "--size", "8x8"}, {"--size", ".spl"});
}

TEST_F(BadInput, ScenesOfEveryFormatThatAreCutShort) {
  const std::vector<std::pair<const char*, std::vector<std::string>>> files{
      {"sh3.ply", {"element vertex", "needs 7479 bytes, and the file has 7478"}},
      {"18_columns.compressed.ply", {"element vertex", "the file has 4941"}},
      {"small.splat", {"at byte 736", "31 of 32 bytes"}},
      {"v3_sh2.spz", {"it ends at byte", "within its gzip stream"}},
      {"v3_bare_sh3.spz", {"its spherical harmonics", "from byte 496 on", "the file has 1575"}},
      {"v4_sh3.spz", {"it ends at byte", "its spherical harmonics"}},
      {"level1_sh1.ksplat", {"the Gaussians of a section", "the file has 6183"}},
      {"v2_sh1.sog", {"it ends at byte", "zip archive", "cut short"}}};
  for (const auto& [name, parts] : files) {
    const std::string bytes = read_file(data_file("formats") / name);
    write(name, bytes.substr(0, bytes.size() - 1));
    std::vector<std::string> expected = parts;
    expected.push_back(name);
    refused_with_outputs({"run", "--scene", name}, expected);
    refused({"scenes", name}, expected);
  }
  for (const char* name : {"sog", "streamed"}) {
    std::filesystem::copy(data_file("formats") / name, folder() / name, std::filesystem::copy_options::recursive);
  }
  std::filesystem::resize_file(folder() / "sog/sh0.webp", 100);
  std::filesystem::resize_file(folder() / "streamed/L_0/quats.webp", 10);
  refused_with_outputs({"run", "--scene", "sog"}, {"sog/sh0.webp", "it ends at byte 100, within its WebP image"});
  refused_with_outputs({"compare", "--scene", "streamed"}, {"streamed/L_0/quats.webp", "it ends at byte 10"});
  std::filesystem::resize_file(folder() / "sog/meta.json", 50);
  refused({"scenes", "sog"}, {"sog/meta.json", "at byte 51", "no JSON"});
}

TEST_F(BadInput, Cameras) {
  refused_with_outputs({"run", "--scene", "good.ply", "--camera", "missing.json"}, {"missing.json", "no such file"});
  refused_with_outputs({"run", "--scene", "good.ply", "--camera", "cameras.json#1"}, {"cameras.json", "1"});
  refused_with_outputs({"run", "--scene", "good.ply", "--camera", "cameras.json#x"}, {"cameras.json", "x"});
  refused_with_outputs({"run", "--scene", "good.ply", "--camera", "broken.json"}, {"broken.json"});
  refused_with_outputs({"run", "--scene", "good.ply", "--camera", "cameras.json", "--eye", "1,2,3"},
                       {"--eye", "--camera"});
  refused_with_outputs({"run", "--scene", "good.ply", "--undistorted"}, {"--undistorted", "there is none", "--camera"});
  refused({"reproduce", "--undistorted"}, {"--undistorted", "there is none", "--camera"});
  refused_with_outputs({"run", "--scene", "good.ply", "--orthographic", "0"}, {"--orthographic", "1e-09 to 1e+09"});
  refused_with_outputs({"run", "--scene", "good.ply", "--orthographic", "wide"}, {"--orthographic", "'wide'"});
  refused_with_outputs({"run", "--orthographic", "3", "--fovy", "40"}, {"--fovy", "--orthographic"});
  refused_with_outputs({"run", "--scene", "good.ply", "--camera", "cameras.json", "--orthographic", "3"},
                       {"--orthographic", "--camera"});
}

TEST_F(BadInput, Machines) {
  refused_with_outputs({"run", "--platform", "agx-orim"}, {"'agx-orim'", "did you mean agx-orin?"});
  refused_with_outputs({"run", "--platform", "agx-orin-lpddr3"}, {"agx-orin has its memory now; give agx-orin"});
  refused_with_outputs({"run", "--variant", "hett"}, {"'hett'", "het+qm"});
  refused_with_outputs({"run", "--fidelity", "exact"}, {"'exact'", "there are functional, bound, lt, cycle"});
  refused_with_outputs({"run", "--format", "rgb10"}, {"'rgb10'", "rgba16f"});
  refused_with_outputs({"run", "--termination", "late"}, {"'late'", "strict"});
  refused_with_outputs({"compare", "--set", "tcc.bins=1"}, {"'tcc'", "did you mean"});
  refused_with_outputs({"compare", "--set", "tc.bin=1"}, {"'bin'", "did you mean tc.bins?"});
  refused_with_outputs({"run", "--set", "crop.cache_bytes=5000", "--fidelity", "functional"},
                       {"crop.cache_bytes", "5000 bytes are no whole lines of 128"});
  refused_with_outputs({"compare", "--format", "rgba32f", "--set", "crop.line_bytes=32"},
                       {"crop.line_bytes, --format"});
  refused_with_outputs({"compare", "--set", "tc.bins=0"}, {"'0'", "tc.bins", "1 to"});
  refused_with_outputs({"compare", "--set", "tc.bins=many"}, {"'many'", "tc.bins"});
  refused_with_outputs({"compare", "--set", "tc.bins=16,32"}, {"'16,32'", "tc.bins", "it is a list"});
  refused_with_outputs({"run", "--set", "crop.cache_bytes=1T"}, {"'1T'", "K, M and G are powers of 1024"});
  refused_with_outputs({"run", "--set", "tc.bins"}, {"'tc.bins'", "UNIT.PARAMETER=VALUE"});
  refused_with_outputs({"run", "--set", "bins=3"}, {"'bins=3'", "UNIT.PARAMETER=VALUE"});
  refused_with_outputs({"run", "--unit", "qqu=pairing"}, {"'qqu'", "did you mean qru?"});
  refused_with_outputs({"run", "--unit", "qru=paring"}, {"'paring'", "qru", "did you mean pairing?"});
  refused_with_outputs({"run", "--unit", "qru"}, {"'qru'", "SLOT=IMPLEMENTATION"});
  refused({"units", "--slot", "tcc"}, {"'tcc'", "did you mean"});
}

// Nothing that was not meant is suggested.
TEST_F(BadInput, NamesLikeNoOther) {
  for (const auto& [arguments, parts] : std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>>{
           {{"run", "--unit", "foo=pairing"}, {"'foo'", "no such slot; ", "`vrpipe units` lists all"}},
           {{"run", "--log", "foo"}, {"'foo'", "no such unit; there are draw, ", "`vrpipe units` lists all"}},
           {{"accuracy", "--quick", "--at-cycle", "foo"},
            {"'foo'", "has none; there are draw, ", "`vrpipe units` lists all"}},
           {{"run", "--platform", "foo"}, {"'foo'", "no such platform; there are agx-orin, "}},
           {{"convert", "nofile", "x.ply"},
            {"no such file; check the path, or take a built-in scene: there are object, "}},
           {{"run", "--scene", "builtin:"}, {"(builtin:)", "there is none of that name; there are object, "}},
           {{"reproduce", "--scene", "foo=good.ply"}, {"(foo=good.ply)", "to put a file in its place; there are "}}}) {
    refused(arguments, parts);
    EXPECT_EQ(vrpipe(arguments).err.find("did you mean"), std::string::npos) << arguments.back();
  }
}

// What would be taken, reported and mean nothing.
TEST_F(BadInput, SettingsWithoutMeaning) {
  refused({"microbench", "kill-rate", "--set", "state.termination_threshold=0.1"},
          {"state.termination_threshold", "the microbenchmark's own", "blend_rounding"});
  refused({"energies", "none.toml", "--toml"}, {"--toml", "leave out FILE"});
  refused({"energies", "--toml", "--markdown"}, {"--toml", "leave out --markdown"});
  for (const char* command : {"energies", "units", "scenes"}) {
    refused({command, "--markdown", "--json", "-"}, {"--markdown, --json -", "in one form"});
  }
  refused({"scenes", "good.ply", "--preview", "p.jpg"}, {"--preview p.jpg", "it is a PNG"});
  refused({"compare", "--scene", "good.ply", "--fidelity", "functional", "--relative-to", "qm"},
          {"--relative-to", "functional has none"});
}

TEST_F(BadInput, Effects) {
  const std::vector<std::pair<const char*, std::vector<std::string>>> lists{
      {"alll", {"unknown effect 'alll'", "did you mean all?"}},
      {"all,-nope", {"unknown effect 'nope'", "nothing declares it; `vrpipe units --effects` lists all"}},
      {"hi_z", {"unknown effect 'hi_z'", "did you mean raster.hi_z?"}},
      {"all,-raster.hiz", {"unknown effect 'raster.hiz'", "did you mean raster.hi_z?"}},
      {",", {"--effects ,", "a name is empty"}},
      {"auto,", {"--effects auto,", "a name is empty"}},
      {"all,,raster.hi_z", {"a name is empty"}},
      {"all,-", {"a name is empty"}},
      {"raster.hi_z,all", {"'all' comes after another word"}},
      {"auto,all", {"'all' comes after another word"}},
      {"-raster.hi_z", {"does not say of what raster.hi_z is left out", "all,-raster.hi_z"}},
      {"all,-sm.alpha_pruning", {"sm.alpha_pruning is always active"}},
      {"all,raster.hi_z,-raster.hi_z", {"raster.hi_z is both taken in and left out"}},
      {"auto,-raster.hi_z,raster.hi_z", {"raster.hi_z is both taken in and left out"}},
      {"raster.hi_z,raster.hi_z", {"raster.hi_z is named twice"}},
      {"all,-raster.hi_z,-raster.hi_z", {"raster.hi_z is named twice"}}};
  for (const char* command : {"run", "compare", "accuracy"}) {
    for (const auto& [list, parts] : lists) refused_with_outputs({command, "--effects", list}, parts);
    refused_with_outputs({command, "--effects", "all", "--effects", "auto"}, {"twice", "--effects", "'all'", "'auto'"});
    refused_with_outputs({command, "--effects", ""}, {"--effects", "it is empty"});
  }
  refused({"run", "--scene", "tiny.spl", "--effects", "auto,-zrop.termination"},
          {"zrop.termination is called for", "left out by force"});
  for (const char* command : {"run", "compare"}) {
    refused_with_outputs({command, "--effects", "all", "--explain-effects"}, {"nothing to explain", "--effects all"});
    refused_with_outputs({command, "--explain-effects=2"}, {"unexpected value (--explain-effects)", "it is a switch"});
  }
  refused({"run", "--explain-effects", "--trace", "trace.json"}, {"--explain-effects", "--trace"});
  refused({"accuracy", "--explain-effects"}, {"'--explain-effects'", "it is an option of `vrpipe run`"});
  refused({"units", "--slot", "clok"}, {"'clok'", "did you mean clock?"});
  refused({"units", "--effects=all"}, {"unexpected value (--effects)", "it is a switch"});
}

TEST_F(BadInput, Plugins) {
  refused_with_outputs({"run", "--plugin", "missing.so"}, {"missing.so", "no such file"});
  refused_with_outputs({"run", "--plugin", "foreign.so"}, {"foreign.so", "not a vrpipe plugin"});
  refused_with_outputs({"run", "--plugin", "words.so"}, {"words.so", "not a vrpipe plugin"});
  refused({"units", "--plugin", "missing.so"}, {"missing.so"});
  // Far too large to be read before it is refused.
  std::filesystem::resize_file(write("huge.so",
                                     "\x7f"
                                     "ELF"),
                               std::uintmax_t{1} << 42U);
  refused({"units", "--plugin", "huge.so"}, {"huge.so", "not a vrpipe plugin"});
}

TEST_F(BadInput, Outputs) {
  refused({"run", "--scene", "tiny.spl", "--output", "file"}, {"--output file", "not a folder"});
  refused({"run", "--scene", "tiny.spl", "--output", "file/images"}, {"--output file/images", "not a folder"});
  refused({"run", "--scene", "tiny.spl", "--json", "nowhere/r.json"}, {"--json nowhere/r.json", "no folder nowhere"});
  refused({"run", "--scene", "tiny.spl", "--json", "folder.ply"}, {"--json folder.ply", "folder"});
  refused({"run", "--scene", "tiny.spl", "--save-draw", "nowhere/d.spl"}, {"--save-draw nowhere/d.spl", "no folder"});
  refused({"run", "--scene", "tiny.spl", "--trace", "nowhere/t.json"}, {"--trace nowhere/t.json", "no folder nowhere"});
  refused({"scenes", "--json", "nowhere/s.json"}, {"nowhere"});
}

TEST_F(BadInput, AFullDiskUnderOneResultLeavesTheOthers) {
  write("study.toml", "scene = \"tiny.spl\"\nfidelity = \"lt\"\n[axes]\ntc.bins = [4]\n");
  for (std::vector<std::string> words :
       std::vector<std::vector<std::string>>{{"run", "--scene", "tiny.spl"},
                                             {"compare", "--scene", "tiny.spl"},
                                             {"accuracy", "--scene", "tiny.spl", "--quick"},
                                             {"microbench", "kill-rate", "--fidelity", "bound"},
                                             {"sweep", "study.toml"}}) {
    SCOPED_TRACE(words[0]);
    std::vector<std::string> all = words;
    words.insert(words.end(), {"--html", "/dev/full", "--json", "ok.json"});
    const Finished finished = vrpipe(words);
    EXPECT_EQ(finished.code, 2);
    EXPECT_EQ(finished.err.rfind("vrpipe: error: cannot write file (--html /dev/full)", 0), 0U) << finished.err;
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
    EXPECT_TRUE(std::filesystem::remove(folder() / "ok.json"));
    EXPECT_NE(finished.out.find("result: ok.json"), std::string::npos) << finished.out;
    EXPECT_EQ(finished.out.find("page: "), std::string::npos) << finished.out;
    all.insert(all.end(), {"--html", "/dev/full", "--json", "/dev/full"});
    EXPECT_NE(vrpipe(all).err.find("; neither could --json /dev/full be written"), std::string::npos);
  }
}

TEST_F(BadInput, AFullDiskUnderWhatIsWrittenDuringARunLeavesItsResult) {
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"--trace", "/dev/full"}, {"--log", "crop", "--log-file", "/dev/full"}}) {
    std::vector<std::string> words{"run", "--scene", "tiny.spl", "--html", "page.html", "--json", "ok.json"};
    words.insert(words.end(), options.begin(), options.end());
    const Finished finished = vrpipe(words);
    EXPECT_EQ(finished.code, 2);
    EXPECT_EQ(finished.err.rfind("vrpipe: error: cannot write file (--", 0), 0U) << finished.err;
    EXPECT_NE(finished.err.find("/dev/full"), std::string::npos) << finished.err;
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
    EXPECT_TRUE(std::filesystem::remove(folder() / "ok.json"));
    EXPECT_TRUE(std::filesystem::remove(folder() / "page.html"));
    EXPECT_NE(finished.out.find("took "), std::string::npos) << finished.out;
    EXPECT_EQ(finished.out.find("trace: "), std::string::npos) << finished.out;
  }
}

// Effects are decided before the cache is made, and ask how many sets it has.
TEST_F(BadInput, ACacheOfLessThanALineIsRefusedByName) {
  for (const char* effects : {"auto", "all"}) {
    refused({"run", "--scene", "tiny.spl", "--platform", "gh100-gpc", "--effects", effects, "--set",
             "crop.cache_bytes=129"},
            {"CROP cache", "crop.cache_bytes"});
  }
}

TEST_F(BadInput, AFullDiskUnderImagesLeavesTheResult) {
  std::filesystem::create_directory(folder() / "images");
  for (const char* command : {"run", "compare", "accuracy"}) {
    const std::string image = std::string(command) == "accuracy" ? "tiny-default" : "tiny-het+qm";
    std::filesystem::create_symlink("/dev/full", folder() / "images" / (image + ".png"));
    std::vector<std::string> words{command, "--scene", "tiny.spl", "--output", "images", "--json", "ok.json"};
    if (std::string(command) == "accuracy") words.emplace_back("--quick");
    const Finished finished = vrpipe(words);
    SCOPED_TRACE(finished.out);
    EXPECT_EQ(finished.code, 2);
    EXPECT_EQ(finished.err.rfind("vrpipe: error: cannot write file (--output images/" + image + ".png)", 0), 0U)
        << finished.err;
    EXPECT_TRUE(std::filesystem::remove(folder() / "ok.json"));
    EXPECT_TRUE(std::filesystem::remove(folder() / "images" / (image + ".exr")));
    std::filesystem::remove(folder() / "images" / (image + ".png"));
    EXPECT_EQ(finished.out.find("image: images/" + image), std::string::npos);
  }
}

TEST_F(BadInput, BrokenGaussiansAreCountedNotFatal) {
  GaussianSceneBuilder builder(0);
  GaussianAttributes gaussian;
  gaussian.position = {0, 0, 5};
  gaussian.log_scale = {-1, -1, -1};
  gaussian.opacity_logit = 3;
  builder.add(gaussian);
  GaussianAttributes broken = gaussian;
  broken.position[1] = std::numeric_limits<float>::quiet_NaN();
  builder.add(broken);
  broken = gaussian;
  broken.position[0] = std::numeric_limits<float>::infinity();
  builder.add(broken);
  broken = gaussian;
  broken.rotation = {0, 0, 0, 0};
  builder.add(broken);
  write_gaussian_file(folder() / "broken.ply", builder.build());
  const std::vector<std::string> arguments{"run",   "--scene", "broken.ply", "--size", "32x32",
                                           "--eye", "0,0,0",   "--look-at",  "0,0,1"};
  const nlohmann::json written = json_of(arguments);
  EXPECT_EQ(written["scene"]["gaussians_total"], 4);
  EXPECT_EQ(written["scene"]["gaussians_visible"], 1);
  EXPECT_EQ(written["scene"]["gaussians_rejected"], 3);
  EXPECT_EQ(written["scene"]["rejected_by_reason"]["not_finite"], 2);
  EXPECT_EQ(written["scene"]["rejected_by_reason"]["zero_quaternion"], 1);
  EXPECT_NE(vrpipe(arguments).out.find("rejected 3 Gaussians"), std::string::npos);
}

}  // namespace
}  // namespace vrpipe::testing
