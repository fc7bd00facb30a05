#include "jobs/imitation.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe::tools {
namespace {

/// Of counts alone, with the extensions.
RunRequest counting(const RunRequest& baseline, const char* variant) {
  RunRequest request = baseline;
  request.variant = variant_named(variant);
  request.name.clear();
  request.fidelity = Fidelity::functional;
  request.termination = Termination::strict;
  request.reads_statistics = true;
  request.observers = nullptr;
  request.stop_at = 0;
  return request;
}

/// Fragments of each pixel until it terminates, row by row.
std::vector<std::uint32_t> fragments_until_termination(const RunRequest& baseline, const Frame& frame) {
  RunRequest request = counting(baseline, "het");
  std::vector<std::uint32_t> counts(std::size_t{frame.width()} * frame.height());
  request.observers = std::make_shared<Observers>();
  request.observers->on_fragments([&](const Observers::Fragments& seen) {
    if (seen.fate != FragmentFate::rasterized && seen.fate != FragmentFate::terminated) return;
    const std::uint32_t step = seen.fate == FragmentFate::rasterized ? 1U : ~0U;
    const std::size_t x = seen.tile.x * screen_tile_pixels + 2U * (seen.position % quads_per_tile_row);
    const std::size_t y = seen.tile.y * screen_tile_pixels + 2U * (seen.position / quads_per_tile_row);
    for (unsigned lane = 0; lane < 4; ++lane) {
      if ((seen.lanes >> lane & 1U) != 0) counts[(y + lane / 2) * frame.width() + x + lane % 2] += step;
    }
  });
  simulate(request, frame);
  return counts;
}

double share(std::uint64_t part, std::uint64_t of) {
  return of == 0 ? 0 : static_cast<double>(part) / static_cast<double>(of);
}

DrawState decrementing(DrawState state) {
  state.early_termination = false;
  state.early_tests = true;
  state.stencil.test = true;
  for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) {
    *face = StencilFace();
    face->compare = Compare::less;  // 0 is less than what is left
    face->pass = StencilOperation::decrement;
    face->bits = face->read_mask = face->write_mask = all_stencil_bits;
  }
  return state;
}

}  // namespace

Imitation imitation_of(const RunRequest& baseline, std::shared_ptr<const Draw> splats, const DrawState& state) {
  if (state.stencil.test) {
    throw UserError("cannot imitate early termination", "the draw", "it has a stencil test of its own",
                    "leave that out");
  }
  DrawState terminating = state;
  terminating.early_termination = true;
  const auto terminated = std::make_shared<Frame>(splats->width, splats->height);
  terminated->draw(splats, terminating);

  Imitation imitation;
  std::vector<std::uint8_t> stencil;
  for (const std::uint32_t fragments : fragments_until_termination(baseline, *terminated)) {
    imitation.pixels_short += fragments > all_stencil_bits ? 1U : 0U;
    stencil.push_back(static_cast<std::uint8_t>(std::min<std::uint32_t>(fragments, all_stencil_bits)));
  }
  const auto frame = std::make_shared<Frame>(splats->width, splats->height);
  frame->draw(std::move(splats), decrementing(state), "imitation");
  frame->preset_stencil(std::move(stencil));
  imitation.frame = frame;

  const RunResult merged = simulate(counting(baseline, "het+qm"), *terminated);
  const StatisticReport* const pairs = statistic_named(merged.statistics, "qru.pairs");
  imitation.paired_quads = share(pairs != nullptr ? 2 * pairs->value : 0, merged.counts.quads_shaded);
  imitation.discarded_quads =
      share(merged.counts.quads_merged, merged.counts.quads_shaded - merged.counts.quads_pruned);
  imitation.request = baseline;
  imitation.request.units.push_back({"sm", "imitated-merging"});
  imitation.request.settings.push_back({"sm", "paired_quads", fmt::format("{:.3f}", imitation.paired_quads)});
  imitation.request.settings.push_back({"sm", "discarded_quads", fmt::format("{:.3f}", imitation.discarded_quads)});
  return imitation;
}

std::optional<Range> imitated_efficiency(const RunResult& baseline, const RunResult& imitation,
                                         const EnergyTable& table) {
  return energy_ratio(energy_amounts(baseline, table), energy_amounts(imitation, table), table);
}

}  // namespace vrpipe::tools
