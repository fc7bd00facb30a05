#include "bound/bound.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/pipeline/slots/prop.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/tgc.h>

namespace vrpipe {

namespace {

constexpr std::array<const char*, Pipeline::places> slots{"draw", "vpo",  "tgc", "raster", "tc",
                                                          "prop", "zrop", "qru", "sm",     "crop"};

double ratio(std::uint64_t items, std::uint64_t per_cycle) {
  return items == 0 ? 0.0 : static_cast<double>(items) / static_cast<double>(per_cycle);
}

}  // namespace

Pipeline::Pipeline(const UntimedGpu& gpu, unsigned gpc) {
  for (unsigned place = 0; place < places; ++place) at[place] = gpu.of_slot(slots[place], gpc);
}

unsigned Pipeline::rank(Place place) { return Registry::instance().slot(slots[place]).rank; }

Pipeline::Place Pipeline::place_of(const std::string& slot) {
  return static_cast<Place>(std::find(slots.begin(), slots.end(), slot) - slots.begin());
}

void Work::add(const Work& other) {
  for (unsigned place = 0; place < of.size(); ++place) {
    for (unsigned kind = 0; kind < of[place].size(); ++kind) of[place][kind] += other.of[place][kind];
  }
  attribute_bytes_written += other.attribute_bytes_written;
}

PhaseBound::PhaseBound(const Configuration& configuration, const UntimedGpu& gpu, unsigned gpc) : pipeline_(gpu, gpc) {
  if (unit(Pipeline::sm)) sm_ = &dynamic_cast<SmBehaviour&>(unit(Pipeline::sm)->behaviour()).time();
  const Netlist& netlist = configuration.netlist();
  for (const UntimedGpu::Placed& placed : gpu.units()) {
    if (placed.instance->gpc != gpc && !placed.instance->in_front_end) continue;
    const BoundTerms terms = placed.unit->terms();
    terms_.bins_vary |= terms.bins_vary;
    terms_.order_varies |= terms.order_varies;
    terms_.updates_hide |= terms.updates_hide;
    // Quads (of as many warps, at worst) in CROP's queue, warps in the SMs, and as much again for the links.
    warps_in_phase_ += 2 * placed.unit->room_in_warps();
    if (placed.unit.get() != unit(Pipeline::crop)) continue;
    for (const MemoryLink& link : netlist.memory_links()) {
      const Instance* const memory = link.from == placed.instance->path ? netlist.find(link.to) : nullptr;
      if (memory == nullptr) continue;
      const MemoryBehaviour::TimingParameters timing = configuration.make_as<MemoryBehaviour>(*memory)->timing();
      memory_ = memory->path;
      memory_bytes_per_cycle_ = timing.bytes_per_cycle;
      terms_.memory_latency_cycles = timing.latency_cycles;
    }
  }
}

std::uint64_t PhaseBound::instructions_of(FragmentShader shader) const {
  return sm_ == nullptr ? 0 : instructions_in(sm_->fragment_program(shader));
}

std::uint64_t PhaseBound::collected(const Work& done) const {
  return unit(Pipeline::tc) == nullptr ? done.rasterized()
                                       : std::min(done.rasterized(), done.of[Pipeline::tc][TcWork::quads]);
}

double PhaseBound::from_memory(std::uint64_t bytes) const {
  return memory_bytes_per_cycle_ == 0 ? 0.0 : ratio(bytes, memory_bytes_per_cycle_);
}

double PhaseBound::least(Pipeline::Place place, const Work& done, bool to_last) const {
  return unit(place) == nullptr ? 0.0 : busiest(parts_of(place, done, to_last));
}

std::array<double, PhaseBound::stages> PhaseBound::cycles_of(const Work& done, bool to_last) const {
  const Work::Items& tests = done.of[Pipeline::zrop];
  const Work::Items& blends = done.of[Pipeline::crop];
  const auto prop_takes = [&](unsigned kind, std::uint64_t quads) {
    const UntimedUnit* const prop = unit(Pipeline::prop);
    return prop == nullptr ? 0.0 : static_cast<double>(quads) * prop->work()[kind].cycles_per_item;
  };
  std::array<double, stages> cycles{};
  cycles[draw] = least(Pipeline::draw, done, to_last);
  cycles[vpo] = least(Pipeline::vpo, done, to_last);
  if (sm_ != nullptr) {
    // Vertices are assembled once their attributes are sent; so many of these may still be on their way.
    const std::uint64_t sent = std::uint64_t{sm_->fetch.attribute_writes} * sm_->fetch.l1.line_bytes;
    const std::uint64_t written = done.attribute_bytes_written - std::min(done.attribute_bytes_written, sent);
    cycles[vpo] = std::max(cycles[vpo], ratio(written, sm_->memory_bytes_per_cycle()));
  }
  cycles[tgc] = least(Pipeline::tgc, done, to_last);
  cycles[raster] = least(Pipeline::raster, done, to_last);
  cycles[tc] = least(Pipeline::tc, done, to_last);
  // Late tests are a stage of their own; and beside which beats updates hide is not known phase by phase.
  Work early = done;
  early.of[Pipeline::zrop][ZropWork::late_tests] = 0;
  if (terms_.updates_hide) early.of[Pipeline::zrop][ZropWork::updates] = 0;
  cycles[test] = std::max({least(Pipeline::zrop, early, to_last), prop_takes(PropWork::bins, collected(done)),
                           from_memory(tests[ZropWork::bytes_moved])});
  cycles[qru] = least(Pipeline::qru, done, to_last);
  cycles[sm] = least(Pipeline::sm, done, to_last);
  Work after_shading;
  after_shading.of[Pipeline::zrop][ZropWork::late_tests] = tests[ZropWork::late_tests];
  cycles[late] =
      std::max(least(Pipeline::zrop, after_shading, to_last), prop_takes(PropWork::late, tests[ZropWork::late_tests]));
  cycles[color] = prop_takes(PropWork::color, blends[CropWork::blend]);
  cycles[memory_of_crop] = from_memory(blends[CropWork::bytes_moved]);
  cycles[crop] = unit(Pipeline::crop) == nullptr ? 0 : unit(Pipeline::crop)->least_cycles(blends);
  return cycles;
}

double PhaseBound::idle_after_last(unsigned stage) const {
  const Pipeline::Place place = stage == draw     ? Pipeline::draw
                                : stage == raster ? Pipeline::raster
                                : stage == test   ? Pipeline::zrop
                                : stage == sm     ? Pipeline::sm
                                                  : Pipeline::places;
  return place == Pipeline::places || unit(place) == nullptr ? 0.0 : unit(place)->idle_after_last();
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
  if (up_to_quads_.rasterized() > 0) {
    const std::array<double, stages> end = end_of(up_to_quads_, true);
    last_quad_ = *std::max_element(end.begin(), end.end());
    ended_ = total_;
    ended_.add(up_to_quads_);
    // Late tests, which are a stage of their own, and updates share the port of the others.
    if (ended_.of[Pipeline::zrop][ZropWork::late_tests] > 0 || terms_.updates_hide)
      last_quad_ = std::max(last_quad_, least(Pipeline::zrop, ended_, true));
  } else if (!has_quads()) {
    Work passed = work;
    passed.of[Pipeline::raster][RasterWork::pairs] = 0;  // for a pair without quads nobody waits
    const std::array<double, stages> end = end_of(passed, true);
    last_quad_ = *std::max_element(end.begin(), end.end());
  }
  const std::array<double, stages> end = end_of(work, false);
  end_before_ = end_;
  end_ = end;
  total_.add(work);
  work = Work();
  up_to_quads_ = Work();
  up_to_quad_ = Work();
}

void PhaseBound::pass_barrier() {
  if (!has_quads()) return;
  for (double& end : end_) end = std::max(end, last_quad_);
}

std::vector<OccupancyPart> PhaseBound::parts_of(Pipeline::Place place, const Work& done, bool to_last) const {
  const Work::Items& tests = done.of[Pipeline::zrop];
  Work::Items items = done.of[place];
  switch (place) {
    case Pipeline::tgc:
      items[TgcWork::primitives] = 0;
      for (const unsigned kind : {RasterWork::setup, RasterWork::bare_setup, RasterWork::rectangle_setup})
        items[TgcWork::primitives] += done.of[Pipeline::raster][kind];
      break;
    case Pipeline::tc: items[TcWork::quads] = collected(done); break;
    case Pipeline::prop:
      items[PropWork::bins] = collected(done);
      items[PropWork::tested] = tests[ZropWork::tests] > 0 ? done.survivors() : 0;
      items[PropWork::color] = done.of[Pipeline::crop][CropWork::blend];
      items[PropWork::late] = tests[ZropWork::late_tests];
      return unit(place)->least_parts(items, false);
    case Pipeline::qru: {
      // A launch ends a cycle.
      const auto rate = static_cast<std::uint64_t>(1 / unit(place)->work()[QruWork::quads].cycles_per_item + 0.5);
      items[QruWork::quads] -= std::min(items[QruWork::quads], items[QruWork::launches] * rate);
      break;
    }
    case Pipeline::crop: return unit(place)->least_parts(items, false);
    default: break;
  }
  return unit(place)->least_parts(items, to_last);
}

}  // namespace vrpipe
