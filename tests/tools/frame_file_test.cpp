// Frames of several draws on the command line.
#include "tool_test_support.h"

#include <numeric>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class FrameFile : public ToolTest {
 protected:
  void SetUp() override {
    GaussianSceneBuilder builder(0);
    GaussianAttributes gaussian;
    gaussian.log_scale = {-1, -1, -1};
    gaussian.opacity_logit = 2;
    for (int i = 0; i < 4; ++i) {
      gaussian.position = {0.2F * static_cast<float>(i), 0, 3.0F + static_cast<float>(i)};
      builder.add(gaussian);
    }
    write_gaussian_file(folder() / "four.ply", builder.build());
    // A wall across the view, in front of the last two Gaussians.
    write("wall.obj", "v -9 -9 4.5\nv 9 -9 4.5\nv 9 9 4.5\nv -9 9 4.5\nf 1 2 3 4\n");
  }

  /// What `run` finds of a frame.
  json run(const std::string& frame, std::vector<std::string> options = {}) const {
    write("frame.json", frame);
    options.insert(options.begin(), {"run", "--frame", "frame.json"});
    return json_of(std::move(options))["runs"][0];
  }

  /// That a frame is refused, by a message that has `parts`.
  void bad(const std::string& frame, std::vector<std::string> parts, std::vector<std::string> options = {}) const {
    SCOPED_TRACE(frame);
    write("frame.json", frame);
    options.insert(options.begin(), {"run", "--frame", "frame.json", "--output", "images", "--json", "result.json"});
    parts.emplace_back("frame.json");
    refused(options, parts);
  }
};

std::uint64_t count(const json& counts_of, const std::string& name) {
  return counts_of["counts"][name].get<std::uint64_t>();
}

TEST_F(FrameFile, ItsFirstDrawsAloneAreTheFrameOfThese) {
  write("three.json", R"({"commands": [{"draw": "tiny.spl"}, {"clear": ["color"]}, {"draw": "tiny.spl", "name": "b"},
                          {"clear": ["color"]}, {"draw": "tiny.spl", "name": "c"}]})");
  write("two.json", R"({"commands": [{"draw": "tiny.spl"}, {"clear": ["color"]}, {"draw": "tiny.spl", "name": "b"}]})");
  const json part = json_of({"run", "--frame", "three.json", "--draws", "2"})["runs"][0];
  const json two = json_of({"run", "--frame", "two.json"})["runs"][0];
  EXPECT_EQ(part["result_hash"], two["result_hash"]);
  EXPECT_EQ(part["draws"], two["draws"]);
  refused({"run", "--frame", "two.json", "--draws", "3"}, {"'3'", "--draws", "two.json has 2 draws"});
  refused({"run", "--scene", "tiny.spl", "--draws", "1"}, {"--draws", "a scene is one draw"});
}

TEST_F(FrameFile, OfOneDrawIsTheScene) {
  for (const std::string scene : {"tiny.spl", "builtin:object"}) {
    std::vector<std::string> options{"--fidelity", "cycle"};
    if (scene != "tiny.spl") options.insert(options.end(), {"--size", "48x48", "--fovy", "5"});
    const json frame = run(R"({"commands": [{"draw": ")" + scene + R"("}]})", options);
    options.insert(options.begin(), {"run", "--scene", scene});
    const json alone = json_of(options)["runs"][0];
    EXPECT_EQ(frame["result_hash"], alone["result_hash"]) << scene;
    EXPECT_EQ(frame["statistics"], alone["statistics"]) << scene;
    EXPECT_TRUE(frame["draws"].is_null());
  }
}

TEST_F(FrameFile, SplatsOfASceneInThreeDrawsAreTheSceneBitForBit) {
  write("frame.json", R"({"commands": [{"draw": "builtin:object", "name": "near", "splats": [0, 1000]},
                                       {"draw": "builtin:object", "name": "middle", "splats": [1000, 60000]},
                                       {"draw": "builtin:object", "name": "far", "splats": [61000, 100000]}]})");
  const std::string visible = std::to_string(61000 + 100000);
  for (const char* fidelity : {"functional", "cycle"}) {
    for (const char* variant : {"baseline", "het+qm"}) {
      const auto result = [&](std::vector<std::string> command) {
        command.insert(command.end(), {"--size", "96x96", "--termination", "strict", "--fidelity", fidelity,
                                       "--variant", variant, "--output", "images"});
        return json_of(command);
      };
      const json frame = result({"run", "--frame", "frame.json"});
      // The same splats as one draw.
      write("whole.json", R"({"commands": [{"draw": "builtin:object", "splats": [0, )" + visible + "]}]}");
      const json whole = result({"run", "--frame", "whole.json"});
      const json& split = frame["runs"][0];
      EXPECT_EQ(read_file(folder() / split["images"]["exr"].get<std::string>()),
                read_file(folder() / whole["runs"][0]["images"]["exr"].get<std::string>()))
          << fidelity << " " << variant;
      EXPECT_EQ(split["counts"], whole["runs"][0]["counts"]) << fidelity << " " << variant;
      if (std::string(fidelity) == "functional") {
        EXPECT_EQ(split["result_hash"], whole["runs"][0]["result_hash"]);
      }
      EXPECT_EQ(frame["scene"]["gaussians_total"], whole["scene"]["gaussians_total"]) << "loaded once";
      ASSERT_EQ(split["draws"].size(), 3U);
      EXPECT_EQ(split["draws"][1]["name"], "middle");
      for (const auto& entry : split["draws"][0]["counts"].items()) {
        const auto add = [&](std::uint64_t sum, const json& draw) { return sum + count(draw, entry.key()); };
        const auto sum = std::accumulate(split["draws"].begin(), split["draws"].end(), std::uint64_t{0}, add);
        EXPECT_EQ(sum, count(split, entry.key())) << entry.key();
      }
    }
  }
}

TEST_F(FrameFile, DrawsHaveStatesOfTheirOwn) {
  const json result = run(R"({"commands": [
      {"draw": "tiny.spl"},
      {"draw": "tiny.spl", "state": {"pruning_threshold": 1, "splat_extent": "aabb"}},
      {"draw": "tiny.spl", "state": {"early_termination": false}}]})",
                          {"--set", "state.pruning_threshold=0"});
  const json& draws = result["draws"];
  EXPECT_EQ(draws[0]["name"], "tiny.spl 1");
  EXPECT_EQ(count(draws[0], "fragments_pruned"), 0U) << "of the command line";
  EXPECT_GT(count(draws[1], "quads_rasterized"), count(draws[0], "quads_rasterized")) << "larger boxes";
  EXPECT_EQ(count(draws[1], "fragments_blended"), 0U) << "all are pruned";
  EXPECT_GT(count(draws[1], "quads_terminated"), 0U);
  EXPECT_EQ(count(draws[2], "quads_terminated"), 0U);
}

TEST_F(FrameFile, ADrawNeedNotBlendAndMayBeOfRectangles) {
  const json result = run(R"({"commands": [
      {"draw": "tiny.spl"},
      {"draw": "tiny.spl", "state": {"splat_extent": "aabb", "blend": false}},
      {"draw": "tiny.spl", "state": {"splat_extent": "fill_rectangle", "blend": false}}]})",
                          {"--variant", "het+qm"});
  const json& draws = result["draws"];
  EXPECT_GT(count(draws[0], "quads_merged"), 0U);
  for (const unsigned replacing : {1U, 2U}) {
    EXPECT_EQ(count(draws[replacing], "quads_merged"), 0U);
    EXPECT_EQ(count(draws[replacing], "quads_terminated"), 0U);
  }
  EXPECT_EQ(count(draws[2], "fragments_blended"), count(draws[1], "fragments_blended"));
  EXPECT_LT(count(draws[2], "primitives"), count(draws[1], "primitives"));
}

TEST_F(FrameFile, AClearMakesTheNextDrawTheFirst) {
  const json result = run(R"({"commands": [{"draw": "tiny.spl"}, {"clear": ["color", "termination"]},
                                           {"draw": "tiny.spl"}, {"clear": ["color"]}, {"draw": "tiny.spl"}]})",
                          {"--variant", "het", "--termination", "strict", "--fidelity", "lt"});
  const json& draws = result["draws"];
  EXPECT_GT(count(draws[0], "quads_terminated"), 0U);
  EXPECT_EQ(draws[0]["counts"], draws[1]["counts"]);
  EXPECT_LT(count(draws[2], "fragments_blended"), count(draws[1], "fragments_blended")) << "pixels stay closed";
}

const std::vector<std::string> from_the_origin{"--eye", "0,0,0", "--look-at", "0,0,1", "--size", "64x48"};

// Whichever way it goes around, one of its sides faces the camera.
TEST_F(FrameFile, AMeshHidesWhatIsBehindIt) {
  const json result = run(R"({"commands": [
      {"draw": "wall.obj", "name": "depth", "state": {"depth": {}, "shader": "none", "cull": "none"}},
      {"draw": "four.ply", "name": "splats", "state": {"depth": {"compare": "less", "write": false}}},
      {"draw": "four.ply", "name": "behind", "state": {"depth": {"compare": "greater", "write": false}}},
      {"draw": "wall.obj", "name": "wall",
       "state": {"depth": {"compare": "equal", "write": false}, "shader": "vertex", "cull": "none"}}]})",
                          from_the_origin);
  const json& draws = result["draws"];
  ASSERT_EQ(draws.size(), 4U);
  EXPECT_EQ(count(draws[0], "fragments_rasterized"), 64U * 48) << "all that the camera sees";
  EXPECT_EQ(count(draws[0], "fragments_unshaded"), 64U * 48);
  EXPECT_GT(count(draws[1], "fragments_shaded"), 0U);
  EXPECT_EQ(count(draws[1], "fragments_shaded") + count(draws[2], "fragments_shaded"),
            count(draws[2], "fragments_rasterized"))
      << "what is not in front is behind";
  EXPECT_EQ(count(draws[3], "fragments_shaded"), 64U * 48);
}

TEST_F(FrameFile, AMeshDrawsTheSidesThatItsStateDoesNotCull) {
  std::vector<std::uint64_t> drawn;
  for (const char* side : {"none", "back", "front"}) {
    const json result =
        run(std::string(R"({"commands": [{"draw": "four.ply"}, {"draw": "wall.obj", "state": {"cull": ")") + side +
                R"("}}]})",
            from_the_origin);
    drawn.push_back(count(result["draws"][1], "primitives"));
  }
  EXPECT_EQ(drawn[0], 2U);
  EXPECT_EQ(drawn[1] + drawn[2], 2U);
  EXPECT_TRUE(drawn[1] == 0 || drawn[2] == 0);
}

// A splat marks the stencil where it is; what is drawn next is drawn there alone, or everywhere else.
TEST_F(FrameFile, AStencilCutsOutWhatADrawHasMarked) {
  const auto fragments = [&](const std::string& compare, const std::string& between) {
    const json result = run(R"({"commands": [
        {"draw": "four.ply", "splats": [0, 1], "state": {"shader": "none", "stencil": {"pass": "replace", "reference": 5}}},
        )" + between + R"(
        {"draw": "wall.obj", "state": {"cull": "none", "stencil": {"compare": ")" +
                                compare + R"(", "reference": 5}}}]})",
                            from_the_origin);
    return count(result["draws"][1], "fragments_shaded");
  };
  const std::uint64_t marked = fragments("equal", "");
  EXPECT_GT(marked, 50U);
  EXPECT_EQ(marked + fragments("not_equal", ""), 64U * 48);
  EXPECT_EQ(fragments("equal", R"({"clear": ["stencil"]},)"), 0U);
  EXPECT_EQ(fragments("equal", R"({"clear": ["stencil"], "stencil": 5},)"), 64U * 48);
  EXPECT_EQ(fragments("equal", R"({"clear": ["depth", "termination"], "depth": 0.5},)"), marked);
}

// What a splat's shader discards leaves no mark, so it marks less than its whole box.
TEST_F(FrameFile, AStencilIsMarkedAfterShadingWhereTheShaderDiscards) {
  const json result = run(R"({"commands": [
      {"draw": "four.ply", "name": "marks", "splats": [0, 1],
       "state": {"pruning_threshold": 0.3, "stencil": {"pass": "replace", "reference": 5}}},
      {"draw": "wall.obj", "name": "early",
       "state": {"cull": "none", "stencil": {"compare": "equal", "reference": 5}}},
      {"draw": "wall.obj", "name": "late",
       "state": {"cull": "none", "late_tests": true, "stencil": {"compare": "equal", "reference": 5}}}]})",
                          from_the_origin);
  const json& draws = result["draws"];
  const std::uint64_t kept = count(draws[0], "fragments_blended");
  EXPECT_GT(kept, 0U);
  EXPECT_GT(count(draws[0], "fragments_pruned"), 0U);
  EXPECT_EQ(count(draws[1], "fragments_shaded"), kept);
  EXPECT_EQ(count(draws[1], "fragments_late_failed"), 0U);
  EXPECT_EQ(count(draws[2], "fragments_shaded"), 64U * 48);
  EXPECT_EQ(count(draws[2], "fragments_late_failed"), 64U * 48 - kept);
}

TEST_F(FrameFile, BadDepthStencilAndMeshes) {
  const auto of_wall = [](const std::string& state) {
    return R"({"commands": [{"draw": "four.ply"}, {"draw": "wall.obj", "state": )" + state + "}]}";
  };
  bad(of_wall(R"({"depth": "less"})"), {"state.depth", "not an object"});
  bad(of_wall(R"({"depth": {"compare": "lesser"}})"), {"state.depth.compare", "did you mean less?"});
  bad(of_wall(R"({"depth": {"write": 1}})"), {"state.depth.write", "true or false"});
  bad(of_wall(R"({"stencil": {"pass": "set"}})"), {"state.stencil.pass", "unknown operation"});
  bad(of_wall(R"({"stencil": {"reference": 128}})"), {"state.stencil.reference", "0 to 127"});
  bad(of_wall(R"({"stencil": {"front": {}, "pass": "keep"}})"), {"state.stencil", "unknown key 'pass'"});
  bad(of_wall(R"({"shader": "splat"})"), {"state.shader", "that of splats"});
  bad(of_wall(R"({"late_tests": 1})"), {"state.late_tests", "true or false"});
  bad(of_wall(R"({"late_tests": true, "shader": "none"})"), {"state.late_tests", "its shader is none"});
  bad(of_wall(R"({"cull": "both"})"), {"state.cull", "back"});
  bad(R"({"commands": [{"draw": "four.ply", "state": {"shader": "lit"}}]})", {"state.shader", "that of a mesh"});
  bad(R"({"commands": [{"draw": "wall.obj", "splats": [0, 1]}]})", {"splats", "a mesh"});
  bad(R"({"commands": [{"draw": "wall.obj"}, {"draw": "tiny.spl"}]})", {"no scene that has a camera"});
  bad(R"({"commands": [{"clear": ["depth"], "depth": 2}, {"draw": "tiny.spl"}]})", {"depth", "0 to 1"});
  bad(R"({"commands": [{"clear": ["depth"], "stencil": 2}, {"draw": "tiny.spl"}]})", {"stencil", "not cleared"});
}

TEST_F(FrameFile, AMeshOfTheCommandLineMakesAMixedFrame) {
  std::vector<std::string> options{"run", "--scene", "four.ply", "--mesh", "wall.obj"};
  options.insert(options.end(), from_the_origin.begin(), from_the_origin.end());
  const json result = json_of(options);
  EXPECT_GT(result["scene"]["triangles"], 0);
  EXPECT_EQ(result["scene"]["triangles_rejected"], 0);
  EXPECT_EQ(result["platform"]["parameters"]["state.depth_format"], "d24");
  refused({"run", "--frame", "frame.json", "--mesh", "wall.obj"}, {"--mesh"});
  refused({"run", "--scene", "tiny.spl", "--mesh", "wall.obj"}, {"--mesh", "draw list"});
  refused({"run", "--scene", "four.ply", "--mesh", "missing.obj"}, {"missing.obj"});
  refused({"run", "--scene", "four.ply", "--mesh", "wall.obj", "--save-draw", "draw.spl"}, {"--save-draw", "meshes"});
  refused({"accuracy", "--scene", "four.ply", "--mesh", "wall.obj", "--save-draw", "draw.spl"},
          {"--save-draw", "meshes"});
  refused({"run", "--scene", "four.ply", "--mesh", "wall.obj", "--json", "wall.obj"}, {"--mesh", "same file"});
}

TEST_F(FrameFile, WithMeshesTheFidelityLadderIsOfThatFrameAndThereIsNoOther) {
  std::vector<std::string> options{"accuracy", "--quick", "--scene", "four.ply", "--mesh", "wall.obj"};
  options.insert(options.end(), from_the_origin.begin(), from_the_origin.end());
  const json result = json_of(options);
  EXPECT_GT(result["scene"]["triangles"], 0);
  EXPECT_TRUE(result["precision"].empty());
  EXPECT_NE(result["precision_left_out"].get<std::string>().find("meshes"), std::string::npos);
  EXPECT_FALSE(result["stress"].empty());
  std::vector<std::string> alone{"run", "--scene", "four.ply", "--mesh", "wall.obj", "--variant", "baseline"};
  alone.insert(alone.end(), from_the_origin.begin(), from_the_origin.end());
  for (const json& level : result["fidelity"]) {
    if (level["variant"] != "baseline" || level["fidelity"] != "cycle") continue;
    EXPECT_EQ(level["result_hash"], json_of(alone)["runs"][0]["result_hash"]);
  }
  options.insert(options.end(), {"--output", "images"});
  refused(options, {"--output", "meshes"});
}

TEST_F(FrameFile, AFileInThePlaceOfABuiltInSceneIsRelativeToTheFileToo) {
  std::filesystem::create_directory(folder() / "frames");
  write("frames/lego.json", R"({"commands": [{"draw": "lego=../four.ply"}]})");
  const json in_frame = json_of({"run", "--frame", "frames/lego.json", "--size", "48x40"});
  const json alone = json_of({"run", "--scene", "lego=four.ply", "--size", "48x40"});
  EXPECT_EQ(in_frame["runs"][0]["result_hash"], alone["runs"][0]["result_hash"]);
  EXPECT_EQ(alone["scene"]["name"], "lego=four.ply");
  refused({"run", "--scene", "lego=four.ply", "--json", "four.ply"}, {"--scene four.ply", "same file"});
}

TEST_F(FrameFile, ScenesShareACameraAndAreRelativeToTheFile) {
  std::filesystem::create_directory(folder() / "frames");
  write("frames/both.json", R"({"commands": [{"draw": "../four.ply"}, {"draw": "builtin:object"}]})");
  const json both = json_of(
      {"run", "--frame", "frames/both.json", "--size", "48x40", "--fidelity", "functional", "--output", "images"});
  const json alone = json_of({"run", "--scene", "four.ply", "--size", "48x40", "--fidelity", "functional"});
  EXPECT_EQ(both["camera"], alone["camera"]) << "the first scene's";
  EXPECT_EQ(both["scene"]["name"], "both.json");
  EXPECT_EQ(
      both["scene"]["gaussians_total"].get<unsigned>(),
      4 + json_of({"run", "--size", "8x8", "--fidelity", "functional"})["scene"]["gaussians_total"].get<unsigned>());
  EXPECT_EQ(both["runs"][0]["draws"][0]["name"], "four.ply");
  EXPECT_EQ(both["runs"][0]["images"]["png"], "images/both-het+qm.png");
  // A draw list of the same size goes with them.
  run(R"({"commands": [{"draw": "tiny.spl"}, {"draw": "four.ply"}]})",
      {"--size", "48x40", "--eye", "0,0,0", "--look-at", "0,0,1"});
}

TEST_F(FrameFile, CompareDrawsItInEveryVariant) {
  write("frame.json", R"({"commands": [{"draw": "tiny.spl"}, {"draw": "tiny.spl", "name": "veil\u0007"}]})");
  const std::vector<std::string> compare{"compare", "--frame", "frame.json"};
  const json result = json_of(compare);
  ASSERT_EQ(result["runs"].size(), 4U);
  for (const json& each : result["runs"]) {
    ASSERT_EQ(each["draws"].size(), 2U);
    EXPECT_EQ(each["draws"][0]["name"], "tiny.spl");
    EXPECT_GT(count(each["draws"][1], "quads_rasterized"), 0U);
  }
  std::uint64_t end = 0;
  for (const char* region : {"color", "depth_stencil", "vertices", "attributes"}) {
    EXPECT_GE(result["addresses"][region]["address"].get<std::uint64_t>(), end) << region;
    end = result["addresses"][region]["address"].get<std::uint64_t>() +
          result["addresses"][region]["bytes"].get<std::uint64_t>();
  }
  EXPECT_EQ(result["addresses"]["primitives"]["bytes"], 0) << "no explicit triangles";
  EXPECT_EQ(result["addresses"]["vertices"]["bytes"], 60 * 48) << "shared by the draws";
  const std::string report = vrpipe(compare).out;
  for (const char* text : {"quads by draw", "\ntiny.spl\n", "\nveil\\x07\n", "\n  qm  "}) {
    EXPECT_NE(report.find(text), std::string::npos) << text << " is not in\n" << report;
  }
}

TEST_F(FrameFile, BadFiles) {
  bad("", {"empty"});
  bad("{", {"not valid JSON", "line 1"});
  bad("[]", {"not an object", "\"commands\""});
  bad("{}", {"it has no \"commands\""});
  bad(R"({"comands": []})", {"unknown key 'comands'", "did you mean commands?"});
  bad(R"({"commands": {}})", {"commands): it is not an array"});
  bad(R"({"commands": []})", {"nothing is drawn"});
  bad(R"({"commands": [{"clear": ["color"]}]})", {"nothing is drawn"});
  bad(R"({"commands": [{"draw": "tiny.spl", "draw": "tiny.spl"}]})", {"\"draw\" twice"});
}

TEST_F(FrameFile, BadCommands) {
  const auto bad_command = [&](const std::string& command, std::vector<std::string> parts) {
    parts.emplace_back("frame.json, command 2");
    bad(R"({"commands": [{"draw": "tiny.spl"}, )" + command + "]}", parts);
  };
  bad_command("3", {"not an object"});
  bad_command("{}", {"neither \"draw\" nor \"clear\""});
  bad_command(R"({"name": "x"})", {"neither \"draw\" nor \"clear\""});
  bad_command(R"({"drwa": "tiny.spl"})", {"unknown key 'drwa'", "did you mean draw?"});
  bad_command(R"({"draw": "tiny.spl", "splat": [0, 1]})", {"unknown key 'splat'", "did you mean splats?"});
  bad_command(R"({"draw": "tiny.spl", "clear": ["color"]})", {"other keys beside \"clear\""});
  bad_command(R"({"draw": 1})", {"draw): it is 1, not a text"});
  bad_command(R"({"draw": )" + std::string(100000, '[') + std::string(100000, ']') + "}",
              {"it is an array, not a text"});
  bad_command(R"({"draw": ""})", {"draw): ", "not a text"});
  bad_command(R"({"draw": "tiny.spl", "name": []})", {"name): ", "not a text"});
  bad_command(R"({"clear": "color"})", {"clear): ", "[\"color\"]"});
  bad_command(R"({"clear": []})", {"clear): "});
  bad_command(R"({"clear": ["colour"]})", {"'colour'", "did you mean color?"});
  for (const char* splats : {"3", "[1]", "[1, 2, 3]", "[-1, 2]", "[0.5, 2]", "[0, 99999999999]", "[\"a\", 2]"}) {
    bad_command(R"({"draw": "tiny.spl", "splats": )" + std::string(splats) + "}", {"splats): ", "[FIRST, COUNT]"});
  }
  bad_command(R"({"draw": "tiny.spl", "splats": [10, 51]})", {"splats): 51 from 10 on", "60 are visible"});
  bad_command(R"({"draw": "tiny.spl", "splats": [61, 0]})", {"splats): ", "60 are visible"});
}

TEST_F(FrameFile, BadStates) {
  const auto bad_state = [&](const std::string& state, std::vector<std::string> parts) {
    parts.emplace_back("frame.json, command 1, state");
    bad(R"({"commands": [{"draw": "tiny.spl", "state": )" + state + "}]}", parts);
  };
  bad_state("3", {"not an object"});
  bad_state(R"({"pruning_treshold": 0.1})", {"'pruning_treshold'", "did you mean pruning_threshold?"});
  bad_state(R"({"early_terminaton": false})", {"did you mean early_termination?"});
  bad_state(R"({"blend": 0})", {"state.blend): it is 0", "true or false"});
  bad_state(R"({"blend": false, "early_termination": true})", {"state.early_termination): the draw does not blend"});
  bad_state(R"({"early_termination": "off"})", {"state.early_termination): it is \"off\"", "true or false"});
  bad_state(R"({"pruning_threshold": 2})", {"state.pruning_threshold): ", "'2'", "from 0 to 1"});
  bad_state(R"({"pruning_threshold": "0.1"})", {"state.pruning_threshold): ", "not a number"});
  bad_state(R"({"depth": {}})", {"state.depth): it is a draw list, whose splats have no depth"});
  bad_state(R"({"splat_extent": 1})", {"state.splat_extent): ", "not a text"});
  bad_state(R"({"splat_extent": "box"})", {"state.splat_extent): ", "obb"});
  for (const char* precision : {"blend_rounding", "exponential", "subpixel_bits"}) {
    bad_state("{\"" + std::string(precision) + "\": \"rtz\"}", {"precision of the hardware", "--set state."});
  }
}

TEST_F(FrameFile, BadScenesAndOptions) {
  write("frame.json", R"({"commands": [{"draw": "tiny.spl"}]})");
  refused({"run", "--frame", "frame.json", "--scene", "tiny.spl"}, {"cannot use option (--scene)"});
  refused({"run", "--frame", "frame.json", "--save-draw", "draw.spl"}, {"cannot use option (--save-draw)", "one draw"});
  refused({"run", "--frame", "frame.json", "--size", "8x8"}, {"--size", ".spl"});
  refused({"run", "--frame", "missing.json"}, {"missing.json", "no such file"});
  refused({"accuracy", "--frame", "frame.json"}, {"'--frame'", "an option of `vrpipe run`"});
  refused({"run", "--frame", "frame.json", "--json", "frame.json"}, {"--frame", "same file"});
  refused({"run", "--frame", "frame.json", "--json", "tiny.spl"}, {"command 1", "same file"});
  bad(R"({"commands": [{"draw": "four.ply"}, {"draw": "tiny.spl"}]})",
      {"cannot draw tiny.spl", "command 2", "48x40", "64x64", "--size 48x40"}, {"--size", "64x64"});
  write("frame.json", R"({"commands": [{"draw": "four.ply"}, {"draw": "missing.ply"}]})");
  refused({"run", "--frame", "frame.json"}, {"missing.ply", "no such file"});
  write("frame.json", R"({"commands": [{"draw": "builtin:objekt"}]})");
  refused({"run", "--frame", "frame.json"}, {"builtin:objekt", "object"});
}

}  // namespace
}  // namespace vrpipe::testing
