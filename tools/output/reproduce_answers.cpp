#include "output/reproduce_answers.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vrpipe::tools {
namespace {

std::string answer_title(const Reproduction& of, const SceneFinding& scene) {
  return of.result.plan.scenes[scene.scene].name;
}

double fall_percent(const Gains& gains) { return 100 * (1 - gains.quads_het / gains.fragments_het); }

Answer fragments_answer(const Reproduction& of) {
  const std::vector<FragmentFinding>& all = of.findings.fragments;
  const auto less = [](const SceneFinding& a, const SceneFinding& b) {
    return fall_percent(a.gains) < fall_percent(b.gains);
  };
  const auto [least, most] = std::minmax_element(of.findings.scenes.begin(), of.findings.scenes.end(), less);
  std::string text = fmt::format("Here they fall by {:.1f} %, from {:.1f} % in {} to {:.1f} % in {}. ",
                                 all.front().fall_percent, fall_percent(least->gains), answer_title(of, *least),
                                 fall_percent(most->gains), answer_title(of, *most));
  text +=
      "Two effects are against each other: pixels of a quad terminate at different depths, which leaves partial quads; "
      "and what is in front has larger splats, whose quads are fuller. ";
  double farthest = 0;
  std::string which;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (!(all[i].fall_percent > farthest) || all[i].settings.find(" alone") != std::string::npos) continue;
    farthest = all[i].fall_percent;
    which = all[i].settings;
  }
  text += fmt::format("Of all that was varied the most comes with {}: {:.1f} %.", settings_text(which), farthest);
  // The best candidate: termination is tested far ahead of blending, and what then comes too late is not counted.
  const std::string far_ahead = "link.qru.warps.depth=8192";
  const auto at = [&](const std::string& what) {
    return std::find_if(all.begin(), all.end(), [&](const auto& finding) { return finding.settings == what; });
  };
  if (const auto six = at("the six scenes with " + far_ahead); six != all.end()) {
    text += fmt::format(
        " With termination tested far ahead of blending ({}) quads are /{:.2f} and fragments /{:.2f}, a fall of {:.1f} "
        "%; and /{:.2f}, a fall of {:.1f} %, if fragments do not count whose pixel has terminated since, though CROP "
        "takes the time of their quads (the paper: {} and {}).",
        far_ahead, six->quads, six->fragments, six->fall_percent, six->fragments_in_time, six->fall_percent_in_time,
        paper_row("R7").says, paper_row("R5").says);
    for (const SceneFinding& scene : of.findings.beside) {
      const std::string name = answer_title(of, scene);
      const auto own = at(name + " with " + far_ahead);
      text += fmt::format(" {} falls by {:.1f} and {:.1f} % then, quads /{:.2f}.", name, own->fall_percent,
                          own->fall_percent_in_time, own->quads);
    }
    text += fmt::format(" What is left to the paper's {:.1f} % is open.", paper_fragment_fall_percent());
  }
  return {"Why do the fragments of a blended quad fall by 25 % under HET in the paper?", text};
}

std::string efficiencies(const StudyPoint& point) {
  return fmt::format("{:.0f} and {:.0f} %", 100 * point.het_efficiency(), 100 * point.het_qm_efficiency());
}

/// The setting whose efficiencies are nearest to the paper's, if none fits both.
std::string nearest_text(const Reproduction& of) {
  const StudyPoint* nearest = nullptr;
  double least = 0;
  for (const auto* points : {&of.findings.indoor_efficiency, &of.findings.efficiency}) {
    for (const StudyPoint& point : *points) {
      if (fits_both(point)) return {};
      const double distance = std::max(std::fabs(point.het_efficiency() - paper_het_efficiency()),
                                       std::fabs(point.het_qm_efficiency() - paper_het_qm_efficiency()));
      if (!std::isfinite(distance) || (nearest != nullptr && distance >= least)) continue;
      least = distance;
      nearest = &point;
    }
  }
  if (nearest == nullptr) return {};
  return fmt::format("Nothing that was varied alone gives both; the nearest is {}, with {}. ",
                     settings_text(nearest->settings), efficiencies(*nearest));
}

Answer efficiency_answer(const Reproduction& of) {
  std::string text =
      fmt::format("Of what the quads suggest HET reaches here {:.0f} % and HET+QM {:.0f} %, over the six scenes. ",
                  100 * of.findings.main.het_efficiency(), 100 * of.findings.main.het_qm_efficiency());
  std::vector<std::string> bound_by_crop, others;
  for (const SceneFinding& scene : of.findings.scenes) {
    const double het = scene.gains.het / scene.gains.quads_het;
    const double both = scene.gains.het_qm / (scene.gains.quads_het * scene.gains.quads_merging);
    constexpr double nearly_all = 0.9;
    (het >= nearly_all ? bound_by_crop : others)
        .push_back(fmt::format("{} ({:.0f} and {:.0f} %)", answer_title(of, scene), 100 * het, 100 * both));
  }
  text += fmt::format("CROP bounds all of the frame in {}. ",
                      bound_by_crop.empty() ? "none" : fmt::format("{}", fmt::join(bound_by_crop, ", ")));
  if (!others.empty()) {
    text += fmt::format(
        "It does not in {}: where nearly every quad is killed, the front end or the z-cache bounds that part of the "
        "frame. ",
        fmt::join(others, ", "));
  }
  const std::vector<StudyPoint>& indoor = of.findings.indoor_efficiency;
  if (indoor.size() > 1) {  // a quick look tries no others
    text += fmt::format("What lowers the one and not the other was looked for in {}, which reaches {} by default: ",
                        of.result.plan.scenes[of.result.plan.indoor].name, efficiencies(indoor.front()));
    std::vector<std::string> candidates;
    for (std::size_t i = 1; i < indoor.size(); ++i) {
      candidates.push_back(fmt::format("{} with {} (QM alone {:.2f}x){}", efficiencies(indoor[i]),
                                       settings_text(indoor[i].settings), indoor[i].qm_best,
                                       fits_both(indoor[i]) ? ", which fits both" : ""));
    }
    text += fmt::format("{}. ", fmt::join(candidates, "; "));
  }
  for (const Reproduction::FrontEnd& front_end : of.front_ends) {
    if (front_end.settings.empty()) continue;
    text += fmt::format("With the front end of {} {}. ", front_end.name, efficiencies(front_end.means));
  }
  text += nearest_text(of);
  text +=
      "The more a variant kills and merges, the sooner the front end bounds it and not CROP; QM also sets a primitive "
      "up once for each tile grid that it touches. A slower QRU takes from QM alone as well, which the paper's 1.49x "
      "excludes. ";
  for (const StudyPoint& point : of.findings.efficiency) {
    if (point.settings != "state.termination_threshold=0.9999") continue;
    text += fmt::format(
        "With a threshold of 0.9999, as the reference renderer in CUDA has it, HET gains {:.2f}x, HET+QM {:.2f}x, and "
        "quads are /{:.2f} (the paper: {}, {}, {}).",
        point.het.arithmetic, point.het_qm.arithmetic, point.quads_het, paper_row("R4").says, paper_row("R2").says,
        paper_row("R7").says);
  }
  return {"Why does HET+QM reach only 82 % of what its quads suggest, where HET reaches 95 %?", text};
}

}  // namespace

std::vector<Answer> answers(const Reproduction& of) { return {fragments_answer(of), efficiency_answer(of)}; }

}  // namespace vrpipe::tools
