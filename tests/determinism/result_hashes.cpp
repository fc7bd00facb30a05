// Prints the result hash of a small built-in scene in every variant, both terminations and three fidelities, in every format, where shaders blend, and of frames in
// software and by accelerators, as this build computes it; scripts/check compares the lines of builds by other compilers and at other levels of optimisation.
#include <cstdio>
#include <exception>

#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {
namespace {

void print_hashes() {
  SceneRequest scene;
  scene.scene = "builtin:courtyard";
  scene.size = ImageSize{120, 90};
  scene.scene_cache = false;  // making it is compared as well
  const LoadedScene loaded = load_scene(scene);
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      for (const Variant& variant : variants()) {
        RunRequest request;
        request.platform = &platforms().front();
        request.variant = variant;
        request.fidelity = fidelity;
        request.termination = termination;
        fresh_simulation();
        const RunResult result = simulate(request, loaded.draw);
        std::printf("%s %s %s %s\n", name_of(fidelity), name_of(termination), variant.name.c_str(),
                    result.result_hash.c_str());
      }
    }
  }
  for (const ColorFormat format : color_formats) {
    if (format == RunRequest().format) continue;
    for (const char* rounding : {"rne", "rtz"}) {
      RunRequest request;
      request.platform = &platforms().front();
      request.variant = variants().back();
      request.fidelity = Fidelity::lt;
      request.format = format;
      request.settings = {{"state", "blend_rounding", rounding}};
      fresh_simulation();
      std::printf("%s %s %s\n", name_of(format), rounding, simulate(request, loaded.draw).result_hash.c_str());
    }
  }
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    for (const Variant& variant : more_variants()) {
      if (!variant.is_of_pipeline()) continue;  // below, with each of their units
      RunRequest request;
      request.platform = &platforms().front();
      request.variant = variant;
      request.fidelity = fidelity;
      fresh_simulation();
      std::printf("%s %s %s\n", name_of(fidelity), variant.name.c_str(),
                  simulate(request, loaded.draw).result_hash.c_str());
    }
  }
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    for (const char* kernel : {"published", "endless", "threshold"}) {
      for (const char* lists : {"three_sigma", "obb", "ellipse"}) {
        RunRequest request;
        request.platform = &platforms().front();
        request.variant = variants().front();
        request.fidelity = fidelity;
        request.units = {{"render", kernel}};
        request.settings = {{"binning", "lists", lists}};
        const SoftwareResult result =
            simulate_software(request, *Frame::of(loaded.draw), loaded.summary.gaussians_total);
        std::printf("software %s %s %s %s\n", name_of(fidelity), kernel, lists, result.result_hash.c_str());
      }
    }
  }
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::bound, Fidelity::lt}) {
    for (const char* unit : {"gscore", "gcc", "flicker"}) {
      RunRequest request;
      request.platform = &platforms().front();
      request.variant = variants().front();
      request.fidelity = fidelity;
      request.units = {{"accelerator", unit}};
      const AcceleratorResult result =
          simulate_accelerator(request, *Frame::of(loaded.draw), loaded.summary.gaussians_total);
      std::printf("accelerator %s %s %s\n", name_of(fidelity), unit, result.result_hash.c_str());
    }
  }
}

}  // namespace
}  // namespace vrpipe

// SystemC's library has a main of its own, which would win over the one in an archive.
int main() {
  try {
    vrpipe::print_hashes();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "result_hashes: %s\n", error.what());
    return 1;
  }
  return 0;
}
