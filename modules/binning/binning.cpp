#include "binning/binning.h"

#include <numeric>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {
constexpr std::uint64_t most_pairs = 0xffffffff;  // as the published sort numbers them, and TileLists
}  // namespace

PairBinning::PairBinning(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      tiling_(context.frame->width(), context.frame->height()),
      shape_(static_cast<ListShape>(static_cast<unsigned>(parameters.lists))),
      count_cycles_(parameters.count_cycles),
      scan_cycles_(parameters.scan_cycles),
      duplicate_cycles_(parameters.duplicate_cycles),
      sort_cycles_(parameters.sort_cycles),
      range_cycles_(parameters.range_cycles),
      launch_microseconds_(parameters.launch_microseconds),
      issue_rate_(parameters.issue_rate) {}

TileLists PairBinning::make_lists() {
  const Frame& frame = *context_.frame;
  const TouchedTiles touched(shape_, frame.width(), frame.height());
  const auto each = [&](const auto& with_splat) {
    for (const DrawCall& call : frame.draws()) {
      for (std::uint32_t splat = call.base; splat < call.base + call.splats; ++splat) {
        if (has_area(call.splat(splat))) with_splat(splat, call.splat(splat));
      }
    }
  };
  const auto index = [&](std::uint32_t x, std::uint32_t y) {
    return tiling_.index({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)});
  };
  // Splats come in order of depth, and so do those of a tile: what is counted here takes the place of sorting.
  TileLists lists;
  lists.begin.assign(tiling_.tiles() + 1, 0);
  std::uint64_t with_area = 0;
  each([&](std::uint32_t, const Splat& splat) {
    bool is_listed = false;
    touched.visit(splat, [&](std::uint32_t x, std::uint32_t y) {
      ++lists.begin[index(x, y) + 1];
      is_listed = true;
    });
    splats_listed += is_listed ? 1U : 0U;
    ++with_area;
  });
  splats_without_area += frame.splats() - with_area;
  const std::uint64_t all = std::accumulate(lists.begin.begin(), lists.begin.end(), std::uint64_t{0});
  if (all > most_pairs) {
    throw UserError("cannot list splats by tiles", "binning",
                    fmt::format("they make {} pairs, of {} at most", all, most_pairs),
                    "take a smaller image, or fewer splats");
  }
  for (std::size_t tile = 0; tile < tiling_.tiles(); ++tile) lists.begin[tile + 1] += lists.begin[tile];
  lists.splats.resize(lists.begin.back());
  std::vector<std::uint32_t> next = lists.begin;
  each([&](std::uint32_t number, const Splat& splat) {
    touched.visit(splat, [&](std::uint32_t x, std::uint32_t y) { lists.splats[next[index(x, y)]++] = number; });
  });
  return lists;
}

std::vector<KernelWork> PairBinning::kernels() const {
  constexpr std::uint64_t pair_bytes = 12;  // a key of 64 bits and a value of 32
  const std::uint64_t splats = context_.frame->splats();
  const std::uint64_t all = pairs.value();
  // Digits of 8 bits: 32 of depth, and those of the tile's number.
  unsigned tile_bits = 0;
  while (std::size_t{1} << tile_bits < tiling_.tiles()) ++tile_bits;
  const std::uint64_t passes = (32 + tile_bits + 7) / 8;
  const auto kernel = [&](const char* name, std::uint64_t items, double cycles, std::uint64_t bytes, double launches) {
    const double sm_cycles = static_cast<double>(items) * cycles;
    constexpr double schedulers = 4;
    return KernelWork{
        name, items, sm_cycles, bytes, launches * launch_microseconds_, schedulers * issue_rate_ * sm_cycles};
  };
  return {kernel("count", all, count_cycles_, splats * (sizeof(Splat) + 4), 1),
          kernel("scan", splats, scan_cycles_, splats * 8, 2),
          kernel("duplicate", all, duplicate_cycles_, splats * (sizeof(Splat) + 4) + all * pair_bytes, 1),
          kernel("sort", all, sort_cycles_, all * (8 + passes * 2 * pair_bytes), 2 + static_cast<double>(passes)),
          kernel("ranges", all, range_cycles_, all * 8 + tiling_.tiles() * 8, 1)};
}

namespace {
const OutsideSlotRegistrar binning_slot("binning", 210, "pairs");
const Registrar<PairBinning, BinningBehaviour> pair_binning(
    "binning", "pairs", "a pair for each splat and tile that it touches, sorted by tile and depth", false,
    Trust::trusted);
}  // namespace

}  // namespace vrpipe
