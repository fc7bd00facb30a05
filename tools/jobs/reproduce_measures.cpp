#include "jobs/reproduce_measures.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "jobs/published_figures.h"

namespace vrpipe::tools {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

double utilization_of(const SceneFinding& scene, const char* unit) {
  for (const auto& [name, value] : scene.runs[0]->run.utilization) {
    if (name == unit) return 100 * value;
  }
  return 0;
}

StorageReport storage_of(const SceneFinding& scene) { return quad_merging_storage(scene.runs[3]->run.request); }

double energy_of(const SceneFinding& scene) {
  const auto &baseline = scene.runs[0]->energy, &extended = scene.runs[3]->energy;
  if (!baseline || !extended) return no_number;
  const std::optional<Range> ratio = energy_ratio(*baseline, *extended, shipped_energies());
  return ratio ? ratio->nominal : no_number;
}

bool is_bound_by_rop(const SceneFinding& scene) {
  const std::optional<Bottleneck>& bottleneck = scene.runs[0]->run.bottleneck;
  return bottleneck &&
         (bottleneck->unit.find("crop") != std::string::npos || bottleneck->unit.find("prop") != std::string::npos);
}

FrameTimes measured(const SceneFinding& scene) { return frame_times(scene, &WholeFrame::measured); }
FrameTimes papers(const SceneFinding& scene) { return frame_times(scene, &WholeFrame::papers); }
double frames_a_second(double milliseconds) { return 1e3 / milliseconds; }

double of_frame(const SceneFinding& scene, double (*of)(const WholeFrame&)) {
  return scene.frame == nullptr ? no_number : of(*scene.frame);
}

/// A quantity's name behind what is taken of it over the scenes.
std::pair<std::string, const Quantity*> parts_of(const std::string& measure) {
  const std::size_t space = measure.find(' ');
  if (space == std::string::npos) return {"", nullptr};
  const std::string over = measure.substr(0, space);
  const bool is_of_one = over.size() > 2 && over.substr(over.size() - 2) == "'s";
  if (over != "mean" && over != "most" && over != "least" && !is_of_one) return {"", nullptr};
  return {over, find_quantity(measure.substr(space + 1))};
}

const PublishedFigure* figure_named(const std::string& measure) {
  for (const PublishedFigure& figure : published_figures()) {
    if (measure == std::string(figure.microbench) + ": " + figure.name) return &figure;
  }
  return nullptr;
}

}  // namespace

const SceneFinding* Evidence::scene(const std::string& name) const {
  for (const auto* some : {&scenes, &large}) {
    for (const SceneFinding& each : *some) {
      if (name_of(each) == name) return &each;
    }
  }
  return nullptr;
}

const std::vector<Quantity>& quantities() {
  using Of = const SceneFinding&;
  static const std::vector<Quantity> all{
      {"speed-up of qm", [](Of of) { return of.gains.qm; }, true},
      {"speed-up of het", [](Of of) { return of.gains.het; }, true},
      {"speed-up of het+qm", [](Of of) { return of.gains.het_qm; }, true},
      {"fall of fragments by het", [](Of of) { return of.gains.fragments_het; }, true},
      {"fall of fragments by qm on het", [](Of of) { return of.gains.fragments_merging; }, true},
      {"fall of fragments by qm on het, second quads whole", [](Of of) { return of.gains.fragments_merging_whole; },
       true},
      {"fall of quads by het", [](Of of) { return of.gains.quads_het; }, true},
      {"fall of quads by qm on het", [](Of of) { return of.gains.quads_merging; }, true},
      {"utilisation of raster", [](Of of) { return utilization_of(of, "raster"); }, true},
      {"utilisation of prop", [](Of of) { return utilization_of(of, "prop"); }, true},
      {"utilisation of zrop", [](Of of) { return utilization_of(of, "zrop"); }, true},
      {"utilisation of sm", [](Of of) { return utilization_of(of, "sm"); }, true},
      {"utilisation of crop", [](Of of) { return utilization_of(of, "crop"); }, true},
      {"ROP bounds the baseline", [](Of of) { return is_bound_by_rop(of) ? 1.0 : 0.0; }, true},
      {"energy of baseline over its imitation of het+qm",
       [](Of of) { return of.imitated_efficiency ? of.imitated_efficiency->nominal : no_number; }, false},
      {"energy of baseline over het+qm", [](Of of) { return energy_of(of); }, false},
      {"early-termination ratio", [](Of of) { return of.ratio_mean; }, false},
      {"greatest early-termination ratio",
       [](Of of) { return of.ratio_distribution ? of.ratio_distribution->maximum : no_number; }, false},
      {"best speed-up of passes", [](Of of) { return *std::max_element(of.passes.begin(), of.passes.end()); }, false},
      {"speed-up of het beside passes", [](Of of) { return of.het_beside_passes; }, false},
      {"time of in-shader blending with a lock", [](Of of) { return of.in_shader; }, false},
      {"time of in-shader blending without a lock", [](Of of) { return of.in_shader_no_lock; }, false},
      {"frame in software over het+qm", [](Of of) { return measured(of).software / measured(of).het_qm; }, false},
      {"frame in software over het+qm, prepared as in the paper",
       [](Of of) { return papers(of).software / papers(of).het_qm; }, false},
      {"frame by hardware over het+qm", [](Of of) { return measured(of).hardware / measured(of).het_qm; }, false},
      {"frame by hardware over het+qm, prepared as in the paper",
       [](Of of) { return papers(of).hardware / papers(of).het_qm; }, false},
      {"percent that the draw is of a frame by hardware",
       [](Of of) { return 100 * measured(of).draw / measured(of).hardware; }, false},
      {"frames a second by hardware", [](Of of) { return frames_a_second(measured(of).hardware); }, false},
      {"frames a second by hardware, prepared as in the paper",
       [](Of of) { return frames_a_second(papers(of).hardware); }, false},
      {"milliseconds of a frame in software", [](Of of) { return measured(of).software; }, false},
      {"milliseconds of a frame by hardware", [](Of of) { return measured(of).hardware; }, false},
      {"milliseconds of a frame by het+qm", [](Of of) { return measured(of).het_qm; }, false},
      {"milliseconds of a frame by GSCore",
       [](Of of) { return of_frame(of, [](const WholeFrame& frame) { return frame.accelerator; }); }, false},
      {"milliseconds before rendering in software", [](Of of) { return measured(of).before_render; }, false},
      {"milliseconds before the draw by hardware", [](Of of) { return measured(of).before_draw; }, false},
      {"percent of lanes that blend in software",
       [](Of of) {
         return of_frame(of, [](const WholeFrame& frame) { return 100 * frame.share_of_lanes_blending(); });
       },
       false},
      {"speed-up of termination in software",
       [](Of of) { return of_frame(of, [](const WholeFrame& frame) { return frame.endless_render / frame.render; }); },
       false},
      {"fall of fragments by termination in software",
       [](Of of) {
         return of_frame(of, [](const WholeFrame& frame) {
           return static_cast<double>(frame.endless_fragments_blended) / static_cast<double>(frame.fragments_blended);
         });
       },
       false},
      {"thousands of Gaussians in view", [](Of of) { return 1e-3 * double(of.runs[0]->gaussians_visible); }, false},
      {"millions of Gaussians", [](Of of) { return 1e-6 * double(of.runs[0]->gaussians_total); }, false},
      {"KB of the TGC", [](Of of) { return double(storage_of(of).tgc_bytes) / 1024; }, false},
      {"bytes of the QRU", [](Of of) { return double(storage_of(of).qru_bytes); }, false},
      {"KB of TGC and QRU", [](Of of) { return double(storage_of(of).tgc_bytes + storage_of(of).qru_bytes) / 1024; },
       false},
  };
  return all;
}

const Quantity* find_quantity(const std::string& name) {
  for (const Quantity& quantity : quantities()) {
    if (quantity.name == name) return &quantity;
  }
  return nullptr;
}

bool is_measure(const std::string& name) { return parts_of(name).second != nullptr || figure_named(name) != nullptr; }

bool is_of_variants(const std::string& measure) {
  const Quantity* const quantity = parts_of(measure).second;
  return quantity != nullptr && quantity->is_of_variants;
}

std::vector<std::string> measure_names() {
  std::vector<std::string> names;
  for (const char* over : {"mean ", "most ", "least "}) {
    for (const Quantity& quantity : quantities()) names.push_back(over + quantity.name);
  }
  for (const PublishedFigure& figure : published_figures()) {
    names.push_back(std::string(figure.microbench) + ": " + figure.name);
  }
  return names;
}

std::optional<Measured> measure(const std::string& name, const Evidence& of) {
  const auto [over, quantity] = parts_of(name);
  if (quantity == nullptr) {
    for (const MicrobenchResult& result : of.result.microbenches) {
      for (const MicrobenchFigure& figure : result.figures) {
        if (result.name + ": " + figure.name == name) return Measured{figure.measured, "", {}};
      }
    }
    return std::nullopt;
  }
  if (over == "mean") {
    std::vector<double> values;
    for (const SceneFinding& scene : of.scenes) values.push_back(quantity->of(scene));
    const Mean mean = mean_of(values);
    return Measured{mean.arithmetic, "", mean.geometric};
  }
  if (over != "most" && over != "least") {
    const SceneFinding* const scene = of.scene(over.substr(0, over.size() - 2));
    return scene == nullptr ? std::nullopt : std::optional(Measured{quantity->of(*scene), "", {}});
  }
  const auto less = [of_scene = quantity->of](const SceneFinding& a, const SceneFinding& b) {
    return of_scene(a) < of_scene(b);
  };
  const auto [least, most] = std::minmax_element(of.scenes.begin(), of.scenes.end(), less);
  const SceneFinding& scene = over == "most" ? *most : *least;
  return Measured{quantity->of(scene), of.name_of(scene), {}};
}

}  // namespace vrpipe::tools
