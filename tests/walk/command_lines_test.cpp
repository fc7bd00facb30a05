// Random command lines: what --print-config writes of one reads back as the same configuration, and does the same.
// VRPIPE_COMMAND_LINES=COUNT and VRPIPE_SEED=SEED in the environment walk on (scripts/fuzz --command-lines).
#include <cctype>
#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include <vrpipe/arithmetic/random.h>

#include "tools/tool_test_support.h"
#include "walk/walk_case.h"

namespace vrpipe::walk {
namespace {

using testing::Finished;
using Words = std::vector<std::string>;

std::uint64_t from_environment(const char* name, std::uint64_t usual) {
  const char* const text = std::getenv(name);
  return text == nullptr ? usual : std::strtoull(text, nullptr, 10);
}

/// What an option may be given: none for a flag. Files are there, or are written.
const std::map<std::string, Words> texts_of = {
    {"--scene", {"tiny.spl", "small.ply", "builtin:object", "room = 1=small.ply"}},
    {"--mesh", {"box.obj"}},
    {"--size", {"32x24", "17x16"}},
    {"--camera", {"cameras.json", "cameras.json#1"}},
    {"--undistorted", {}},
    {"--eye", {"1,2,-3", "0,0,-4.5"}},
    {"--look-at", {"0,0,0", "1e-3,0,.5"}},
    {"--up", {"0,-1,0", "0,1,0"}},
    {"--fovy", {"45", "50.5"}},
    {"--orthographic", {"3", "0.25"}},
    {"--no-scene-cache", {}},
    {"--frame", {"frame.json"}},
    {"--multi-pass", {"2", "3"}},
    {"--views", {"2", "all"}},
    {"--platform", {"agx-orin", "mobile", "gh100-gpc", "desktop"}},
    {"--variant",
     {"baseline", "qm", "het", "het+qm", "own=het,tc.bins=7", "a b=qm,qru=pass-through", "in-shader",
      "lpddr5=qm,dram=lpddr5-6400"}},
    {"--set",
     {"tc.bins=5", "crop.cache_bytes=8K", "crop.forwarding=off", "gpc0.tc.bins=9", "preprocess.dilation=0.1",
      "link.tc.bins.depth=3", "state.pruning_threshold=1e-5"}},
    {"--unit", {"qru=pass-through", "tgc=pass-through", "qru=same-splat"}},
    {"--plugin", {VRPIPE_PLUGIN_FILE}},
    {"--fidelity", {"functional", "bound", "lt", "cycle", "sampled"}},
    {"--error", {"1%", "0.5"}},
    {"--seed", {"1", "77"}},
    {"--effects", {"all", "auto", "approximate", "auto,raster.hi_z", "approximate,crop.blend_hazard"}},
    {"--format", {"rgba8", "rgba16f", "rgba32f", "rgba16", "srgb8"}},
    {"--termination", {"paper", "strict"}},
    {"--background", {"0,0.5,1", "1,1,1"}},
    {"--relative-to", {"baseline", "het", "mobile/baseline", "own"}},
    {"--output", {"images", "im ages/#1"}},
    {"--json", {"out.json", "a \"b\".json", "-"}},
    {"--save-draw", {"saved.spl"}},
    {"--jobs", {"1", "2"}},
    {"--journal", {"journal"}},
    {"--html", {"page.html"}},
    {"--energy", {}},
    {"--energies", {"energies.toml"}},
    {"--rows", {"rows.toml"}},
    {"--beside", {"mine=small.ply", "other=tiny.spl"}},
    {"--explain-effects", {}},
    {"--interval", {"100", "4096"}},
    {"--interval-csv", {"intervals.csv"}},
    {"--interval-statistics", {"tc.flushes", "tc.*,crop.quads_blended"}},
    {"--trace", {"trace.pftrace", "trace.pftrace@5:900", "trace.pftrace@:900"}},
    {"--log", {"crop", "gpc0.tc@10:50"}},
    {"--log-file", {"events.log"}},
    {"--heat-maps", {}},
    {"--until", {"700", "1"}},
    {"--draws", {"1", "2"}},
    {"--markdown", {"page.md"}},  // of reproduce; of accuracy a flag
    {"--quick", {}},
    {"--repeat", {"1", "3"}},
    {"--at-cycle", {"crop", "zrop,sm"}},
};
const std::set<std::string> may_be_repeated = {"--set", "--unit", "--variant", "--platform",
                                               "--log", "--mesh", "--at-cycle"};
const Words commands = {"run", "compare", "accuracy", "microbench", "reproduce"};
const Words microbenchmarks = {"tile-binning", "crop-cache", "all", "same-place"};

struct Declared {
  std::string name;
  bool is_flag;
};

class CommandLines : public testing::ToolTest {
 protected:
  CommandLines() {
    std::filesystem::copy_file(VRPIPE_FORMATS "/sh0.ply", folder() / "small.ply");
    write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("frame.json", R"({"commands": [{"draw": "tiny.spl"}, {"clear": ["color"]}, {"draw": "tiny.spl"}]})");
    write(
        "cameras.json",
        R"([{"id":0,"img_name":"one","width":32,"height":24,"position":[0,0,-4],"rotation":[[1,0,0],[0,1,0],[0,0,1]],)"
        R"("fx":30,"fy":30},{"id":1,"img_name":"two","width":32,"height":24,"position":[0,0,-5],)"
        R"("rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":30,"fy":30}])");
    write("energies.toml", vrpipe({"energies", "--toml"}).out);
    write("rows.toml",
          "schema = 'vrpipe.paper-rows/1'\n[[row]]\nid = 'A'\nsection = 'I'\nwhat = 'w'\nsays = 's'\nkind = 'input'\n"
          "why = 'it is'\n");
  }
  std::vector<Declared> options_of(const std::string& command) const {
    std::istringstream help(vrpipe({command, "--help"}).out);
    std::vector<Declared> options;
    const std::regex option("  (--[a-z-]+)( [A-Z].*)?.*");
    for (std::string line; std::getline(help, line);) {
      std::smatch found;
      if (!std::regex_match(line, found, option)) continue;
      if (found[1] != "--config" && found[1] != "--print-config") options.push_back({found[1], !found[2].matched});
    }
    return options;
  }
};

std::string without_comments(const std::string& text) {
  return std::regex_replace(text, std::regex(" +#[^\n]*|(^|\n)#[^\n]*"), "");
}

/// Takes out what depends on how it was asked for, on how files are named, or on the host.
void strip(nlohmann::json& value) {
  if (value.is_object()) {
    for (const char* key : {"command", "config", "host", "origins", "file", "images", "host_seconds", "cpu_seconds"})
      value.erase(key);
  }
  for (nlohmann::json& part : value) {
    if (part.is_structured()) strip(part);
  }
}
nlohmann::json comparable(const std::string& text) {
  nlohmann::json result = nlohmann::json::parse(text, nullptr, false);
  strip(result);
  return result;
}

TEST_F(CommandLines, PrintedReadBackToTheSame) {
  const std::uint64_t seed = from_environment("VRPIPE_SEED", 20261125);
  const std::uint64_t count = from_environment("VRPIPE_COMMAND_LINES", 60);
  fmt::print("VRPIPE_SEED={} VRPIPE_COMMAND_LINES={}\n", seed, count);
  std::map<std::string, std::vector<Declared>> options;
  for (const std::string& command : commands) {
    options[command] = options_of(command);
    ASSERT_GT(options[command].size(), 5U) << command;
    for (const Declared& option : options[command])
      EXPECT_EQ(texts_of.count(option.name), 1U) << command << " " << option.name << ": give it values above";
  }
  const Draw real = testing::tiny_draw();
  std::uint64_t printed = 0;
  std::uint64_t simulated = 0;
  for (std::uint64_t index = 0; index < count && !HasFailure(); ++index) {
    std::uint64_t state = mix(mix(seed) ^ index);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>((state = mix(state + 1)) % n); };
    const std::string& command = commands[below(8) % commands.size()];
    const bool simulates = (command == "run" || command == "compare") && below(4) > 0;
    Words words{command};
    if (command == "microbench") words.push_back(microbenchmarks[below(microbenchmarks.size())]);
    if (command != "microbench" && command != "reproduce" && below(4) > 0)
      words.insert(words.end(), {"--scene", below(2) == 0 ? "tiny.spl" : "small.ply", "--size", "32x24"});
    if (below(2) == 0) {
      for (const Setting& setting : draw_case(seed, index, real).settings)
        words.insert(words.end(), {"--set", setting.unit + "." + setting.parameter + "=" + setting.value});
    }
    const std::size_t more = below(5);
    for (std::size_t i = 0; i < more; ++i) {
      const Declared& option = options[command][below(options[command].size())];
      const bool is_there = std::find(words.begin(), words.end(), option.name) != words.end();
      if (is_there && may_be_repeated.count(option.name) == 0) continue;
      words.push_back(option.name);
      const Words& texts = texts_of.at(option.name);
      if (!option.is_flag) words.push_back(texts[below(texts.size())]);
    }
    SCOPED_TRACE(fmt::format("VRPIPE_SEED={}, line {}: vrpipe {}", seed, index, fmt::join(words, " ")));

    const auto print = [&](Words of) {
      of.emplace_back("--print-config");
      return vrpipe(std::move(of));
    };
    const Finished first = print(words);
    EXPECT_TRUE(first.code == 0 || first.code == 2) << first.err;
    if (first.code != 0) continue;
    ++printed;
    write("printed.toml", first.out);
    // As its first line says.
    const std::string& text = first.out;
    const std::size_t begin = text.find("vrpipe ") + 7;
    std::istringstream says(text.substr(begin, text.find(" --config THIS_FILE") - begin));
    Words again;
    for (std::string word; says >> word;) again.push_back(word);
    again.insert(again.end(), {"--config", "printed.toml"});
    const Finished second = print(again);
    EXPECT_EQ(second.err, first.err);
    EXPECT_EQ(without_comments(second.out), without_comments(text));
    const auto has = [&](const char* word) { return std::find(words.begin(), words.end(), word) != words.end(); };
    const bool is_small = (has("tiny.spl") || has("small.ply") || has("frame.json")) && !has("--explain-effects");
    if (!simulates || !is_small || has("--json")) continue;
    for (Words* each : {&words, &again}) each->insert(each->end(), {"--json", "-"});
    const Finished once = vrpipe(words);
    const Finished twice = vrpipe(again);
    ++simulated;
    EXPECT_EQ(twice.code, once.code) << once.err << twice.err;
    if (once.code != 0) continue;
    EXPECT_EQ(nlohmann::json::diff(comparable(once.out), comparable(twice.out)).dump(), "[]");
  }
  if (count < 50) return;
  EXPECT_GT(printed, count / 4);
  EXPECT_GT(simulated, count / 30);
}

}  // namespace
}  // namespace vrpipe::walk
