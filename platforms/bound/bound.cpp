#include "bound/bound.h"

#include <algorithm>
#include <map>
#include <type_traits>

#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/draw.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

namespace {

double ratio(std::uint64_t items, std::uint64_t per_cycle) {
  return items == 0 ? 0.0 : static_cast<double>(items) / static_cast<double>(per_cycle);
}

/// Cycles of so many items, each so long after the one before; if they are the last of the draw, up to the last item.
double spaced(std::uint64_t items, double cycles, bool to_last) {
  if (items == 0) return 0;
  return to_last ? static_cast<double>(items - 1) * cycles + 1 : static_cast<double>(items) * cycles;
}

/// Thousandths of a cycle of which the last item has no more than `longest`: nobody waits for what it takes.
std::uint64_t without_last(std::uint64_t thousandths, std::uint64_t longest) {
  return thousandths - std::min(thousandths, longest);
}

std::uint64_t sum_of(const std::vector<ShaderSegment>& program) {
  std::uint64_t sum = 0;
  for (const ShaderSegment& segment : program) sum += segment.instructions;
  return sum;
}

}  // namespace

void Work::add(const Work& other) {
  vertex_warps_issued += other.vertex_warps_issued;
  triangles += other.triangles;
  bin_entries += other.bin_entries;
  setups += other.setups;
  coarse_tiles += other.coarse_tiles;
  fine_tiles += other.fine_tiles;
  tile_pairs += other.tile_pairs;
  quads_rasterized += other.quads_rasterized;
  bin_beats += other.bin_beats;
  quads_tested += other.quads_tested;
  updates += other.updates;
  z_sectors += other.z_sectors;
  z_blocks += other.z_blocks;
  z_lines += other.z_lines;
  survivors += other.survivors;
  late_quads += other.late_quads;
  vertex_warps += other.vertex_warps;
  attribute_bytes_written += other.attribute_bytes_written;
  warps += other.warps;
  fragment_instructions += other.fragment_instructions;
  merging_warps += other.merging_warps;
  launches += other.launches;
  for (std::size_t kind = 0; kind < crop.size(); ++kind) crop[kind] += other.crop[kind];
}

std::uint64_t Work::color_quads() const { return crop[CropWork::blend]; }

bool PhaseBound::knows(const std::string& slot) {
  constexpr const char* known[] = {"draw", "vpo", "tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"};
  return std::find(std::begin(known), std::end(known), slot) != std::end(known);
}

PhaseBound::PhaseBound(const Configuration& configuration, const UntimedUnit* crop_unit, unsigned gpc)
    : crop_(crop_unit) {
  const auto cost_of = [&](const char* slot, auto* of_slot, const auto& take) {
    for (const Instance& instance : configuration.netlist().instances()) {
      if (instance.slot != slot || (instance.gpc != gpc && !instance.in_front_end)) continue;
      return take(*configuration.make_as<std::remove_pointer_t<decltype(of_slot)>>(instance));
    }
  };
  cost_of("draw", static_cast<DrawBehaviour*>(nullptr),
          [&](const auto& unit) { vertex_warps_per_cycle_ = unit.warps_per_1024_cycles() / 1024.0; });
  cost_of("vpo", static_cast<VpoBehaviour*>(nullptr), [&](const auto& unit) { vpo_ = unit.timing(); });
  cost_of("tgc", static_cast<TgcBehaviour*>(nullptr), [&](const auto& unit) { tgc_ = unit.timing(); });
  cost_of("raster", static_cast<RasterBehaviour*>(nullptr), [&](const auto& unit) { raster_ = unit.timing(); });
  cost_of("tc", static_cast<TcBehaviour*>(nullptr), [&](const auto& unit) { tc_ = unit.timing(); });
  cost_of("prop", static_cast<PropBehaviour*>(nullptr), [&](const auto& unit) { prop_ = unit.timing(); });
  cost_of("zrop", static_cast<ZropBehaviour*>(nullptr), [&](const auto& unit) { zrop_ = unit.timing(); });
  cost_of("qru", static_cast<QruBehaviour*>(nullptr), [&](const auto& unit) { qru_ = unit.timing(); });
  cost_of("sm", static_cast<SmBehaviour*>(nullptr), [&](const auto& unit) { sm_ = unit.timing(); });
  // Warps in the SMs, quads (of as many warps, at worst) in CROP's queue, and as much again for the links.
  const std::uint64_t in_crop = crop_ == nullptr ? 0 : crop_->room_in_warps();
  warps_in_phase_ = 2 * (std::uint64_t{sm_.cores} * sm_.warps_per_core + in_crop);
  times_out_ = tc_.timeout_in(configuration.request().termination) > 0;
  cost_of("l2", static_cast<MemoryBehaviour*>(nullptr), [&](const auto& memory) {
    l2_bytes_per_cycle_ = memory.timing().bytes_per_cycle;
    l2_latency_cycles_ = memory.timing().latency_cycles;
  });
}

double PhaseBound::instructions(const Work& done) const {
  return static_cast<double>(done.vertex_warps * sum_of(sm_.vertex) + done.fragment_instructions +
                             done.merging_warps * sum_of(sm_.merge));
}

std::uint64_t PhaseBound::instructions_of(FragmentShader shader) const { return sum_of(sm_.fragment_program(shader)); }

std::array<double, PhaseBound::stages> PhaseBound::cycles_of(const Work& done, bool to_last) const {
  std::array<double, stages> cycles{};
  cycles[draw] = spaced(done.vertex_warps_issued, 1 / vertex_warps_per_cycle_, to_last);
  // Vertices are assembled once their attributes are sent; so many of these may still be on their way.
  const std::uint64_t sent = std::uint64_t{sm_.fetch.attribute_writes} * sm_.fetch.l1.line_bytes;
  cycles[vpo] = std::max(ratio(done.triangles, vpo_.items_per_cycle),
                         ratio(done.attribute_bytes_written - std::min(done.attribute_bytes_written, sent),
                               std::uint64_t{sm_.cores} * sm_.fetch.core_bytes));
  cycles[tgc] = std::max(ratio(done.bin_entries, tgc_.items_per_cycle), ratio(done.setups, 1));
  cycles[raster] = std::max({spaced(done.setups, raster_.setup_interval_thousandths / 1000.0, to_last),
                             ratio(done.coarse_tiles, raster_.coarse_tiles_per_cycle),
                             ratio(done.fine_tiles, raster_.fine_tiles_per_cycle),
                             spaced(done.tile_pairs, raster_.screen_tile_interval_thousandths / 1000.0, to_last),
                             ratio(done.quads_rasterized, raster_.quads_per_cycle)});
  cycles[tc] = std::max(ratio(done.quads_rasterized, tc_.quads_per_cycle), ratio(done.bin_beats, 1));
  const auto from_l2 = [&](std::uint64_t bytes) {
    return l2_bytes_per_cycle_ == 0 ? 0.0 : ratio(bytes, l2_bytes_per_cycle_);
  };
  const std::uint64_t z_blocks = to_last ? without_last(done.z_blocks, longest_beat_of_blocks()) : done.z_blocks;
  const std::uint64_t launches = to_last ? without_last(done.launches, longest_launch()) : done.launches;
  // Beside which beats updates hide is not known phase by phase.
  const double updates = updates_hide() ? 0.0 : update_cycles(done);
  cycles[test] =
      std::max({ratio(done.quads_tested, zrop_.quads_per_cycle) + ratio(z_blocks, 1000) + updates + sector_cycles(done),
                ratio(done.z_lines, 1000), ratio(done.quads_rasterized, prop_.quads_per_cycle),
                from_l2(done.z_sectors * zrop_.z_cache.organization.sector_bytes)});
  cycles[qru] = std::max(ratio(done.survivors, qru_.items_per_cycle), ratio(done.warps, 1));
  cycles[sm] = std::max(instructions(done) / sm_.instructions_per_cycle(), ratio(launches, 1000));
  cycles[late] = ratio(done.late_quads, std::min(zrop_.quads_per_cycle, prop_.quads_per_cycle));
  cycles[color] = static_cast<double>(done.color_quads()) / prop_.color_rate.per_cycle();
  cycles[l2] = from_l2(done.crop[CropWork::bytes_moved]);
  cycles[crop] = crop_ == nullptr ? 0 : crop_->least_cycles(done.crop);
  return cycles;
}

std::uint64_t PhaseBound::z_sectors_of(std::uint64_t filled) const {
  const std::uint64_t ahead = zrop_.z_cache.input_quads;
  const std::uint64_t sectors = filled > ahead ? filled - ahead : 0;
  return sectors - sectors % zrop_.z_cache.sectors_per_cycle;
}

bool PhaseBound::updates_hide() const {
  return zrop_.quads_per_cycle < QuadBeat::capacity || zrop_.block_thousandths != 0 ||
         zrop_.primitive_thousandths != 0 || zrop_.half_block_thousandths != 0;
}

double PhaseBound::update_cycles(const Work& done) const {
  const double updates = ratio(done.updates, zrop_.updates_per_cycle);
  if (!updates_hide()) return updates;
  return std::max(0.0, updates - ratio(done.quads_tested, zrop_.quads_per_cycle) - ratio(done.z_blocks, 1000));
}

double PhaseBound::sector_cycles(const Work& done) const {
  // A cycle in which sectors move may be the last that a block takes part of.
  return std::max(0.0, ratio(done.z_sectors, zrop_.z_cache.sectors_per_cycle) - ratio(done.z_blocks, 1000));
}

std::uint64_t PhaseBound::longest_launch() const {
  const HandOverPrice& price = sm_.hand_over;
  return price.warp_thousandths + quads_per_warp * (std::uint64_t{price.visit_thousandths} + price.discard_thousandths);
}
std::uint64_t PhaseBound::longest_beat_of_blocks() const {
  const std::uint64_t block = std::max(zrop_.half_block_thousandths, zrop_.block_thousandths);
  return QuadBeat::capacity * (block + zrop_.primitive_thousandths);
}

double PhaseBound::idle_after_last(unsigned stage) const {
  if (stage == sm) return ratio(longest_launch(), 1000);
  if (stage == test) return ratio(longest_beat_of_blocks(), 1000);
  const double interval =
      stage == draw ? 1 / vertex_warps_per_cycle_
      : stage == raster
          ? std::max(raster_.setup_interval_thousandths, raster_.screen_tile_interval_thousandths) / 1000.0
          : 1.0;
  return std::max(0.0, interval - 1);
}

std::array<double, PhaseBound::stages> PhaseBound::end_of(const Work& done, bool to_last) const {
  const std::array<double, stages> cycles = cycles_of(done, to_last);
  std::array<double, stages> end{};
  for (unsigned stage = 0; stage < stages; ++stage) {
    double begin = 0;
    for (unsigned before = 0; before < stage; ++before) begin = std::max(begin, end_[before] - idle_after_last(before));
    // Whose last item was one of an earlier phase: for what it takes after it, the last quad does not wait.
    begin = std::max(begin, end_[stage] - (to_last && cycles[stage] == 0 ? idle_after_last(stage) : 0));
    for (unsigned after = stage + 1; stage >= raster && after < stages; ++after)
      begin = std::max(begin, end_before_[after]);
    end[stage] = begin + cycles[stage];
    if (stage > 0) end[stage] = std::max(end[stage], end[stage - 1] - (to_last ? 0 : idle_after_last(stage - 1)));
  }
  return end;
}

void PhaseBound::end_phase() {
  if (up_to_quads_.quads_rasterized > 0) {
    const std::array<double, stages> end = end_of(up_to_quads_, true);
    last_quad_ = *std::max_element(end.begin(), end.end());
    ended_ = total_;
    ended_.add(up_to_quads_);
    // Late tests, which are a stage of their own, and updates share the port of the others.
    if (ended_.late_quads > 0 || updates_hide()) last_quad_ = std::max(last_quad_, busiest(parts("zrop")));
  } else if (!has_quads()) {
    Work passed = work;
    passed.tile_pairs = 0;  // for a pair without quads nobody waits
    const std::array<double, stages> end = end_of(passed, true);
    last_quad_ = *std::max_element(end.begin(), end.end());
  }
  const std::array<double, stages> end = end_of(work, false);
  end_before_ = end_;
  end_ = end;
  total_.add(work);
  work = Work();
  up_to_quads_ = Work();
  up_to_quad_ = FrontEndWork();
}

void PhaseBound::pass_barrier() {
  if (!has_quads()) return;
  for (double& end : end_) end = std::max(end, last_quad_);
}

double busiest(const std::vector<OccupancyPart>& parts) {
  double longest = 0;
  std::map<unsigned, double> resources;
  for (const OccupancyPart& part : parts) {
    longest = std::max(longest, resources[part.resource] += part.cycles);
  }
  return longest;
}

std::vector<OccupancyPart> PhaseBound::parts(const std::string& slot) const {
  const Work& done = ended_;
  const auto priced = [](const std::vector<WorkKind>& kinds, const std::vector<double>& items) {
    std::vector<OccupancyPart> parts;
    for (std::size_t i = 0; i < items.size(); ++i) {
      const WorkKind& kind = kinds[i];
      parts.push_back({kind.name, kind.resource, items[i] * kind.cycles_per_item, kind.is_throughput});
    }
    return parts;
  };
  const auto count = [](std::uint64_t items) { return static_cast<double>(items); };
  if (slot == "draw")
    return priced(DrawWork::kinds(), {spaced(done.vertex_warps_issued, 1 / vertex_warps_per_cycle_, true)});
  if (slot == "vpo") return priced(VpoWork::kinds(vpo_), {count(done.triangles)});
  if (slot == "tgc") return priced(TgcWork::kinds(tgc_), {count(done.bin_entries), count(done.setups)});
  if (slot == "raster") {
    const double setup = raster_.setup_interval_thousandths / 1000.0;
    const double pair = raster_.screen_tile_interval_thousandths / 1000.0;
    const double setups = spaced(done.setups, setup, true) / setup;
    const double pairs = spaced(done.tile_pairs, pair, true) / pair;
    return priced(RasterWork::kinds(raster_),
                  {setups, count(done.coarse_tiles), count(done.fine_tiles), pairs, count(done.quads_rasterized)});
  }
  if (slot == "tc") return priced(TcWork::kinds(tc_), {count(done.quads_rasterized), count(done.bin_beats)});
  if (slot == "prop") {
    return priced(PropWork::kinds(prop_),
                  {count(done.quads_rasterized), done.quads_tested > 0 ? count(done.survivors) : 0.0,
                   count(done.color_quads()), 0.0, count(done.late_quads)});
  }
  if (slot == "zrop") {
    return priced(ZropWork::kinds(zrop_),
                  {count(done.quads_tested), update_cycles(done), sector_cycles(done) * zrop_.z_cache.sectors_per_cycle,
                   count(done.late_quads), count(without_last(done.z_blocks, longest_beat_of_blocks())),
                   count(done.z_lines)});
  }
  if (slot == "qru") {
    const double quads = count(done.survivors) - count(done.warps) * qru_.items_per_cycle;
    return priced(QruWork::kinds(qru_), {std::max(quads, 0.0), count(done.warps)});
  }
  if (slot == "sm") {
    return priced(SmWork::kinds(sm_), {count(done.vertex_warps * sum_of(sm_.vertex)), count(done.fragment_instructions),
                                       count(done.merging_warps * sum_of(sm_.merge)),
                                       count(without_last(done.launches, longest_launch()))});
  }
  if (slot == "crop") return priced(crop_->work(), {count(done.color_quads()), count(done.crop[CropWork::sectors])});
  if (slot == "l2" && l2_bytes_per_cycle_ > 0)
    return {{"bytes", 0, ratio(done.crop[CropWork::bytes_moved], l2_bytes_per_cycle_), true}};
  return {};
}

}  // namespace vrpipe
