// Prints the result hash of a small built-in scene in every variant, both terminations and three fidelities, in every
// format, where shaders blend, and of frames in software and by accelerators, as this build computes it; scripts/check
// compares the lines of builds by other compilers and at other levels of optimisation.
//   result_hashes [PART PARTS]     only every PARTS-th line, from PART on, counted from 0
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {
namespace {

struct Case {
  std::string name;
  std::function<std::string()> hash;
};

RunRequest request_of(const Variant& variant, Fidelity fidelity) {
  RunRequest request;
  request.platform = &platforms().front();
  request.variant = variant;
  request.fidelity = fidelity;
  return request;
}

std::vector<Case> cases(const LoadedScene& scene) {
  std::vector<Case> all;
  const auto draw = [&](std::string name, const RunRequest& request) {
    all.push_back({std::move(name), [&scene, request] {
                     fresh_simulation();
                     return simulate(request, scene.draw).result_hash;
                   }});
  };
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      for (const Variant& variant : variants()) {
        RunRequest request = request_of(variant, fidelity);
        request.termination = termination;
        draw(fmt::format("{} {} {}", name_of(fidelity), name_of(termination), variant.name), request);
      }
    }
  }
  for (const ColorFormat format : color_formats) {
    if (format == RunRequest().format) continue;
    for (const char* rounding : {"rne", "rtz"}) {
      RunRequest request = request_of(variants().back(), Fidelity::lt);
      request.format = format;
      request.settings = {{"state", "blend_rounding", rounding}};
      draw(fmt::format("{} {}", name_of(format), rounding), request);
    }
  }
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    for (const Variant& variant : more_variants()) {
      if (!variant.is_of_pipeline()) continue;  // below, with each of their units
      draw(fmt::format("{} {}", name_of(fidelity), variant.name), request_of(variant, fidelity));
    }
  }
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    for (const char* kernel : {"published", "endless", "threshold"}) {
      for (const char* lists : {"three_sigma", "obb", "ellipse"}) {
        RunRequest request = request_of(variants().front(), fidelity);
        request.units = {{"render", kernel}};
        request.settings = {{"binning", "lists", lists}};
        all.push_back(
            {fmt::format("software {} {} {}", name_of(fidelity), kernel, lists), [&scene, request] {
               return simulate_software(request, *Frame::of(scene.draw), scene.summary.gaussians_total).result_hash;
             }});
      }
    }
  }
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::bound, Fidelity::lt}) {
    for (const char* unit : {"gscore", "gcc", "flicker"}) {
      RunRequest request = request_of(variants().front(), fidelity);
      request.units = {{"accelerator", unit}};
      all.push_back(
          {fmt::format("accelerator {} {}", name_of(fidelity), unit), [&scene, request] {
             return simulate_accelerator(request, *Frame::of(scene.draw), scene.summary.gaussians_total).result_hash;
           }});
    }
  }
  return all;
}

void print_hashes(std::size_t part, std::size_t parts) {
  SceneRequest request;
  request.scene = "builtin:courtyard";
  request.size = ImageSize{120, 90};
  request.scene_cache = false;  // making it is compared as well
  const LoadedScene scene = load_scene(request);
  const std::vector<Case> all = cases(scene);
  for (std::size_t i = part; i < all.size(); i += parts)
    std::printf("%s %s\n", all[i].name.c_str(), all[i].hash().c_str());
}

}  // namespace
}  // namespace vrpipe

// SystemC's library has a main of its own, which would win over the one in an archive.
int main(int argc, char** argv) {
  try {
    const bool is_part = argc == 3;
    vrpipe::print_hashes(is_part ? std::strtoul(argv[1], nullptr, 10) : 0,
                         is_part ? std::strtoul(argv[2], nullptr, 10) : 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "result_hashes: %s\n", error.what());
    return 1;
  }
  return 0;
}
