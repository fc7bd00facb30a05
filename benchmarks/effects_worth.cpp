// What it is worth to simulate only the effects that a frame calls for: host time of `all` as a ratio to `auto`, together
// and effect by effect.
//   effects_worth [--short] [--repeat N]
// What is compared runs in turn, N times (default: 5), and the medians of processor seconds are compared: a slow spell of
// the machine meets all. --short takes parts of small frames once, to see that it works.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/mixed_frame.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {

namespace {

struct Workload {
  const char* name;
  const char* scene;
  ImageSize size;
  std::uint32_t passes;           ///< of early termination by software
  std::vector<Setting> settings;  ///< of the run
};

// A splat-only object in a small window; one in a window that no cache holds; a mixed frame; and one that calls for all that
// a frame can call for.
const std::vector<Workload>& workloads() {
  static const std::vector<Workload> made = {
      {"object, 160x160", "builtin:object", {160, 160}, 1, {}},
      {"outdoor, 980x545", "builtin:outdoor", {980, 545}, 1, {}},
      {"courtyard, 960x540", "builtin:courtyard", {960, 540}, 1, {}},
      {"adversarial, 480x270",
       "builtin:courtyard",
       {480, 270},
       4,
       {{"crop", "forwarding", "off"}, {"tc", "bins", "8"}, {"tgc", "bins", "8"}}}};
  return made;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

class Measurement {
 public:
  Measurement(const Workload& workload, std::size_t most_splats) : workload_(workload) {
    SceneRequest request;
    request.scene = workload.scene;
    request.size = workload.size;
    scene_ = load_scene(request);
    scene_.draw.splats.resize(std::min(scene_.draw.splats.size(), most_splats));
  }

  RunRequest request(const char* platform, const char* variant, Fidelity fidelity) const {
    RunRequest made;
    made.platform = &platform_named(platform);
    made.variant = variant_named(variant);
    made.fidelity = fidelity;
    for (const Setting& setting : workload_.settings) {
      if (setting.unit != "tgc" || made.variant.quad_merging) made.settings.push_back(setting);
    }
    made.reads_statistics = false;  // nobody does
    return made;
  }

  /// Medians of the processor seconds of each choice, which run in turn. Throws std::runtime_error where results differ.
  std::vector<double> seconds(RunRequest request, const std::vector<EffectChoice>& choices, int repeat) {
    std::vector<std::vector<double>> runs(choices.size());
    std::string hash;
    for (int run = 0; run < repeat; ++run) {
      for (std::size_t i = 0; i < choices.size(); ++i) {
        request.effects = choices[i];
        fresh_simulation();
        last_ = simulate(request, *frame(request));
        runs[i].push_back(last_.cpu_seconds);
        if (hash.empty()) hash = last_.result_hash;
        if (hash != last_.result_hash) throw std::runtime_error(choices[i].text() + " has another result than auto");
      }
    }
    std::vector<double> medians;
    for (std::vector<double>& each : runs) medians.push_back(median(std::move(each)));
    return medians;
  }
  const RunResult& last() const { return last_; }

 private:
  std::shared_ptr<Frame> frame(const RunRequest& request) const {
    MixedFrameOptions options;
    options.splats = draw_state_of(request);
    options.passes = workload_.passes;
    return mixed_frame(scene_.draw, scene_.meshes, options);
  }

  const Workload& workload_;
  LoadedScene scene_;
  RunResult last_;
};

EffectChoice with(const std::string& effect) {
  EffectChoice choice;
  choice.with.push_back(effect);
  return choice;
}

unsigned omitted_in(const RunResult& result) {
  return static_cast<unsigned>(std::count_if(result.effects.begin(), result.effects.end(),
                                             [](const EffectReport& effect) { return effect.omitted; }));
}

void together(std::size_t most_splats, int repeat) {
  std::printf("%-22s %-15s %-9s %-11s %8s %8s %8s\n", "frame", "platform", "variant", "fidelity", "omitted", "auto, s",
              "all/auto");
  for (const Workload& workload : workloads()) {
    Measurement measurement(workload, most_splats);
    for (const char* platform : {"agx-orin-ideal-memory", "agx-orin"}) {
      for (const char* variant : {"baseline", "het+qm"}) {
        for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
          const RunRequest request = measurement.request(platform, variant, fidelity);
          const std::vector<double> seconds =
              measurement.seconds(request, {EffectChoice::everything(), EffectChoice()}, repeat);
          std::printf("%-22s %-15s %-9s %-11s %8u %8.3f %8.2f\n", workload.name, platform, variant, name_of(fidelity),
                      omitted_in(measurement.last()), seconds[1], seconds[0] / seconds[1]);
          std::fflush(stdout);
        }
      }
    }
  }
}

/// Of what a splat-only frame without quad merging and early termination does without: each effect alone, taken in.
void one_by_one(std::size_t most_splats, int repeat) {
  Measurement measurement(workloads()[0], most_splats);
  std::vector<std::string> names;
  std::vector<std::vector<double>> ratios;
  const std::vector<std::pair<const char*, Fidelity>> runs = {{"agx-orin-ideal-memory", Fidelity::lt},
                                                              {"agx-orin-ideal-memory", Fidelity::cycle},
                                                              {"agx-orin", Fidelity::functional},
                                                              {"agx-orin", Fidelity::cycle}};
  for (const auto& [platform, fidelity] : runs) {
    const RunRequest request = measurement.request(platform, "baseline", fidelity);
    measurement.seconds(request, {EffectChoice()}, 1);
    std::vector<EffectChoice> choices{EffectChoice()};
    names.clear();
    for (const EffectReport& effect : measurement.last().effects) {
      names.push_back(effect.name);
      if (effect.omitted) choices.push_back(with(effect.name));
    }
    const std::vector<RunResult> before{measurement.last()};
    const std::vector<double> seconds = measurement.seconds(request, choices, repeat);
    ratios.emplace_back();
    std::size_t next = 1;
    for (const EffectReport& effect : before.front().effects) {
      ratios.back().push_back(effect.omitted ? seconds[next++] / seconds[0] : 0.0);
    }
  }
  std::printf("\n%s, baseline: each effect that is omitted, taken in, against auto\n%-22s", workloads()[0].name, "");
  for (const auto& each : runs) std::printf(" %16s", each.first);
  std::printf("\n%-22s", "effect");
  for (const auto& each : runs) std::printf(" %16s", name_of(each.second));
  std::printf("\n");
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::all_of(ratios.begin(), ratios.end(), [&](const auto& of_run) { return of_run[i] == 0; })) continue;
    std::printf("%-22s", names[i].c_str());
    for (const std::vector<double>& of_run : ratios) {
      if (of_run[i] == 0) {
        std::printf(" %16s", "active");
      } else {
        std::printf(" %16.2f", of_run[i]);
      }
    }
    std::printf("\n");
  }
}

int run(const std::vector<std::string>& arguments) {
  int repeat = 5;
  std::size_t most_splats = ~std::size_t{0};
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--repeat" && i + 1 < arguments.size()) {
      repeat = std::max(1, std::stoi(arguments[++i]));
    } else if (arguments[i] == "--short") {
      repeat = 1;
      most_splats = 500;
    } else {
      const bool help = arguments[i] == "--help";
      std::fprintf(help ? stdout : stderr, "usage: effects_worth [--short] [--repeat N]\n");
      return help ? 0 : 2;
    }
  }
  std::printf("medians of processor seconds, %d run%s in turn\n", repeat, repeat == 1 ? "" : "s");
  together(most_splats, repeat);
  one_by_one(most_splats, repeat);
  return 0;
}

}  // namespace

}  // namespace vrpipe

int main(int argc, char** argv) {
  try {
    return vrpipe::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "effects_worth: %s\n", error.what());
    return 2;
  }
}
