#include <map>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include "image/color_scale.h"
#include "image/images.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

const std::vector<std::string> fates{"rasterized", "terminated", "merged", "blended"};

/// `--heat-maps`.
class HeatMapFiles : public ToolTest {
 protected:
  std::vector<float> channel(const std::string& name, const std::string& of, std::uint32_t width,
                             std::uint32_t height) const {
    Imf::InputFile file((folder() / name).c_str(), 1);
    std::vector<float> values(std::size_t{width} * height);
    Imf::FrameBuffer pixels;
    pixels.insert(of,
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), sizeof(float), sizeof(float) * width));
    EXPECT_EQ(file.header().dataWindow().max.x + 1, static_cast<int>(width));
    EXPECT_EQ(file.header().dataWindow().max.y + 1, static_cast<int>(height));
    EXPECT_NE(file.header().channels().findChannel(of), nullptr) << of;
    file.setFrameBuffer(pixels);
    file.readPixels(0, static_cast<int>(height) - 1);
    return values;
  }
  static double sum(const std::vector<float>& values) {
    double total = 0;
    for (const float value : values) total += static_cast<double>(value);
    return total;
  }
};

TEST_F(HeatMapFiles, SumToTheCountsAtEveryFidelityAndChangeNothing) {
  for (const char* termination : {"paper", "strict"}) {
    for (const char* fidelity : {"functional", "bound", "lt", "cycle"}) {
      SCOPED_TRACE(std::string(termination) + " " + fidelity);
      const std::vector<std::string> command{"run",           "--scene",   "tiny.spl", "--fidelity", fidelity,
                                             "--termination", termination, "--output", "o"};
      std::vector<std::string> with_maps = command;
      with_maps.emplace_back("--heat-maps");
      const json run = json_of(with_maps)["runs"][0];
      EXPECT_EQ(run["result_hash"], json_of(command)["runs"][0]["result_hash"]);
      const bool has_time = !run["cycles"].is_null() && std::string(fidelity) != "bound";
      const json legend = json::parse(read_file(folder() / "o/tiny-het+qm-heat-maps.json"));
      for (const std::string& fate : fates) {
        auto expected = run["counts"]["fragments_" + fate].get<double>();
        if (fate == "terminated") expected += run["counts"]["fragments_dropped_late"].get<double>();
        // In so short a run no update comes in time.
        const bool is_late = fate == "terminated" && std::string(termination) == "paper" && has_time;
        EXPECT_EQ(expected > 0, !is_late) << fate;
        EXPECT_EQ(sum(channel("o/tiny-het+qm-pixels.exr", fate, 48, 40)), expected) << fate;
        EXPECT_EQ(sum(channel("o/tiny-het+qm-tiles.exr", fate, 3, 3)), expected) << fate;
        EXPECT_EQ(legend["pixels"][fate]["sum"], expected);
      }
      EXPECT_EQ(legend["pixels"].contains("termination_cycle"), has_time);
      std::filesystem::remove_all(folder() / "o");
    }
  }
}

TEST_F(HeatMapFiles, TellWhenPixelsTerminate) {
  for (const char* fidelity : {"lt", "cycle"}) {
    const json run = json_of({"run", "--scene", "tiny.spl", "--fidelity", fidelity, "--termination", "strict",
                              "--output", "o", "--heat-maps"})["runs"][0];
    const std::vector<float> cycles = channel("o/tiny-het+qm-pixels.exr", "termination_cycle", 48, 40);
    const std::vector<float> terminated = channel("o/tiny-het+qm-pixels.exr", "terminated", 48, 40);
    unsigned pixels = 0;
    for (std::size_t i = 0; i < cycles.size(); ++i) {
      EXPECT_LE(cycles[i], run["cycles"].get<float>());
      if (terminated[i] > 0) {
        EXPECT_GT(cycles[i], 0) << "pixel " << i << " has terminated before";
      }
      pixels += cycles[i] > 0 ? 1 : 0;
    }
    EXPECT_GE(pixels, run["counts"]["termination_updates"]) << "at least one a signal";
    const std::vector<float> tiles = channel("o/tiny-het+qm-tiles.exr", "termination_cycle", 3, 3);
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
      float latest = 0;
      bool is_open = false;
      for (std::size_t y = tile / 3 * 16; y < std::min<std::size_t>(40, tile / 3 * 16 + 16); ++y) {
        for (std::size_t x = tile % 3 * 16; x < tile % 3 * 16 + 16; ++x) {
          latest = std::max(latest, cycles[48 * y + x]);
          is_open = is_open || cycles[48 * y + x] == 0;
        }
      }
      EXPECT_EQ(tiles[tile], is_open ? 0 : latest);
    }
  }
}

TEST_F(HeatMapFiles, AreWrittenForEachVariant) {
  EXPECT_EQ(vrpipe({"compare", "--scene", "tiny.spl", "--output", "o", "--heat-maps", "--jobs", "2"}).code, 0);
  std::size_t expected = 3;
  for (const char* variant : {"baseline", "qm", "het", "het+qm"}) {
    for (const char* of : {"pixels", "tiles"}) {
      for (const char* map : {"rasterized", "terminated", "merged", "blended", "termination_cycle"}) {
        const std::string name = std::string("o/tiny-") + variant + "-" + of + "-" + map + ".png";
        EXPECT_EQ(read_file(folder() / name).rfind("\x89PNG", 0), 0U) << name;
      }
    }
    expected += 1 + 2 + 10 + 2;
  }
  EXPECT_EQ(files().size(), expected - 1);
  EXPECT_EQ(sum(channel("o/tiny-baseline-pixels.exr", "merged", 48, 40)), 0);
  EXPECT_GT(sum(channel("o/tiny-qm-pixels.exr", "merged", 48, 40)), 0);
}

// Kernels neither merge nor signal.
TEST_F(HeatMapFiles, OfSoftwareAreOfWhatItTells) {
  EXPECT_EQ(vrpipe({"run", "--scene", "builtin:object", "--size", "48x40", "--variant", "software", "--output", "o",
                    "--heat-maps"})
                .code,
            0);
  const json legend = json::parse(read_file(folder() / "o/object-software-heat-maps.json"));
  for (const char* of : {"pixels", "tiles"}) {
    const std::string stem = std::string("o/object-software-") + of + "-";
    for (const char* map : {"rasterized", "blended"}) {
      EXPECT_TRUE(std::filesystem::exists(folder() / (stem + map + ".png"))) << map;
      EXPECT_GT(legend[of][map]["sum"], 0) << map;
    }
    for (const char* map : {"merged", "termination_cycle"}) {
      EXPECT_FALSE(std::filesystem::exists(folder() / (stem + map + ".png"))) << map;
      EXPECT_FALSE(legend[of].contains(map)) << map;
    }
  }
}

TEST_F(HeatMapFiles, AreRefusedWithoutAFolder) {
  refused({"run", "--scene", "tiny.spl", "--heat-maps"}, {"--heat-maps", "add --output DIR"});
  refused({"run", "--scene", "tiny.spl", "--heat-maps=2", "--output", "o"}, {"--heat-maps", "it is a switch"});
  refused({"run", "--scene", "tiny.spl", "--heat-maps", "--output", "o", "--json", "o/tiny-het+qm-pixels.exr"},
          {"is the same file"});
  refused({"compare", "--views", "2", "--output", "o", "--heat-maps"}, {"--heat-maps", "or --views"});
}

TEST(ColorScale, GrowsBrighterAllTheWay) {
  double before = -1;
  for (unsigned step = 0; step <= 64; ++step) {
    const std::array<std::uint8_t, 3> color = tools::viridis(step / 64.0);
    const double brightness = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    EXPECT_GT(brightness, before) << step;
    before = brightness;
  }
}

}  // namespace
}  // namespace vrpipe::testing
