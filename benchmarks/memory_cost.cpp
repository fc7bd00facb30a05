// What each part of the memory system costs in host time, as ratios to a GPU whose memory is ideal.
//   memory_cost [--short] [--repeat N] [SCENE]
// SCENE is a file or builtin:NAME; without one, builtin:outdoor at 640x480. Every part is run in turn, N times (default: 5),
// and the medians of processor seconds are compared: a slow spell of the machine meets all of them. --short takes a part
// of a small scene once, to see that it works.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {

namespace {

/// agx-orin-ideal-memory with so much of its memory.
struct Part {
  const char* name;
  std::function<void(Netlist&)> wire;
};

/// Holds everything, answers at once what it is asked for, and misses nothing.
void add_ideal_dram(Netlist& netlist) {
  netlist.add("dram", "l2", "fixed-latency");
  netlist.connect_memory("l2", "dram");
}

// Each has what is above it; the last is agx-orin.
const std::vector<Part>& parts() {
  static const std::vector<Part> made = {
      {"ideal memory", wire_pipeline},
      {"+ sectored L2",
       [](Netlist& netlist) {
         wire_pipeline(netlist);
         netlist.replace("l2", "sectored-cache");
         add_ideal_dram(netlist);
       }},
      {"+ LPDDR3",
       [](Netlist& netlist) {
         wire_pipeline(netlist);
         wire_dram(netlist, "lpddr3-1600");
       }},
      {"+ attributes",
       [](Netlist& netlist) {
         wire_pipeline(netlist);
         wire_dram(netlist, "lpddr3-1600");
         connect_attribute_traffic(netlist);
       }},
      {"+ depth-stencil",
       [](Netlist& netlist) {
         wire_pipeline(netlist);
         wire_dram(netlist, "lpddr3-1600");
         connect_attribute_traffic(netlist);
         connect_depth_stencil_traffic(netlist);
       }},
  };
  return made;
}

constexpr Fidelity measured[] = {Fidelity::functional, Fidelity::lt, Fidelity::cycle};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double seconds(const Draw& draw, const Platform& platform, const Variant& variant, Fidelity fidelity) {
  RunRequest request;
  request.platform = &platform;
  request.variant = variant;
  request.fidelity = fidelity;
  // Nothing of its result waits for them.
  if (fidelity == Fidelity::functional) request.effects.with = {"l2.contents", "dram.accesses"};
  fresh_simulation();
  return simulate(request, draw).cpu_seconds;
}

void measure(const Draw& draw, const Variant& variant, Fidelity fidelity, int repeat) {
  std::vector<std::vector<double>> runs(parts().size());
  for (int run = 0; run < repeat; ++run) {
    for (std::size_t i = 0; i < parts().size(); ++i) {
      Platform platform = platform_named("agx-orin-ideal-memory");
      platform.wire = parts()[i].wire;
      runs[i].push_back(seconds(draw, platform, variant, fidelity));
    }
  }
  const double ideal = median(runs.front());
  std::printf("%-9s %-11s %9.3f", variant.name.c_str(), name_of(fidelity), ideal);
  for (const std::vector<double>& of_part : runs) std::printf(" %15.3f", median(of_part) / ideal);
  std::printf("\n");
  std::fflush(stdout);
}

int run(const std::vector<std::string>& arguments) {
  int repeat = 5;
  std::size_t most_splats = ~std::size_t{0};
  SceneRequest request;
  request.scene = "builtin:outdoor";
  request.size = ImageSize{640, 480};
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--repeat" && i + 1 < arguments.size()) {
      repeat = std::max(1, std::stoi(arguments[++i]));
    } else if (arguments[i] == "--short") {
      repeat = 1;
      most_splats = 2000;
      request.scene = "builtin:object";
      request.size = ImageSize{96, 64};
    } else if (arguments[i].rfind('-', 0) == 0) {
      const bool help = arguments[i] == "--help";
      std::fprintf(help ? stdout : stderr,
                   "usage: memory_cost [--short] [--repeat N] [SCENE]\n"
                   "SCENE: a file or builtin:NAME; without one builtin:outdoor, 640x480\n");
      return help ? 0 : 2;
    } else {
      request.scene = arguments[i];
      request.size.reset();
    }
  }
  LoadedScene scene = load_scene(request);
  scene.draw.splats.resize(std::min(scene.draw.splats.size(), most_splats));
  std::printf("CPU seconds with ideal memory, and ratios to it; medians of %d runs in turn\n%-9s %-11s %9s", repeat,
              "variant", "fidelity", "seconds");
  for (const Part& part : parts()) std::printf(" %15s", part.name);
  std::printf("\n");
  for (const char* variant : {"baseline", "het+qm"}) {
    for (const Fidelity fidelity : measured) measure(scene.draw, variant_named(variant), fidelity, repeat);
  }
  return 0;
}

}  // namespace

}  // namespace vrpipe

int main(int argc, char** argv) {
  try {
    return vrpipe::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "memory_cost: %s\n", error.what());
    return 2;
  }
}
