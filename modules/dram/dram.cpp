#include "dram/dram.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

DramSettings::DramSettings(const DramParameters& parameters)
    : timing(timing_of(parameters)),
      map(parameters),
      channels(parameters.channels),
      burst_bytes(vrpipe::burst_bytes(parameters)),
      port_requests(parameters.port_requests),
      tck_ps(parameters.tck_ps),
      controller_ps(parameters.controller_ps) {}

Dram::Dram(const DramParameters& parameters, const RenderContext& context)
    : settings_(parameters), refresh_gate_(context, "dram.refresh"), timing_{} {
  const DramTiming& t = settings_.timing;
  // That of a row hit.
  const std::uint64_t least_ps = (t.cl + t.burst) * settings_.tck_ps + settings_.controller_ps;
  timing_.latency_cycles = static_cast<std::uint32_t>(least_ps / context.clock_ps);
  timing_.bytes_per_cycle =
      static_cast<std::uint32_t>(std::ceil(peak_bytes(parameters, static_cast<double>(context.clock_ps))));
}

void Dram::access(const MemoryRequest& request) {
  count(request);
  if (!counts_least_) return;
  if (channels_.empty()) {
    channels_.resize(settings_.channels);
    for (Channel& channel : channels_) channel.written.assign(settings_.timing.write_queue, ~std::uint64_t{0});
  }
  const unsigned bursts = settings_.bursts(request.bytes);
  for (unsigned i = 0; i < bursts; ++i) {
    const std::uint64_t address = request.address + i * settings_.burst_bytes;
    const std::uint64_t burst = address / settings_.burst_bytes;
    Channel& channel = channels_[settings_.map.place_of(address).channel];
    // What is queued to be written is read from there, and written over there.
    if (std::find(channel.written.begin(), channel.written.end(), burst) != channel.written.end()) continue;
    channel.bursts += request.is_certain && is_for_quads(request) ? 1U : 0U;
    if (request.command != tlm::TLM_WRITE_COMMAND) continue;
    channel.written[channel.next] = burst;
    channel.next = channel.next + 1 < channel.written.size() ? channel.next + 1 : 0;
  }
}

std::vector<OccupancyPart> Dram::least_occupancy(double period_ps) const {
  const DramTiming& t = settings_.timing;
  Cycle most = 0;
  for (const Channel& channel : channels_) {
    // The last of what is written may stay in the queue.
    Cycle cycles = (channel.bursts - std::min<std::uint64_t>(channel.bursts, t.write_queue)) * t.burst;
    const Cycle refreshes = t.refresh ? cycles / t.refi : 0;
    if (refreshes > 0 && EffectGate(refresh_gate_).enter()) cycles += refreshes * t.rfc;
    most = std::max(most, cycles);
  }
  return {{"data", 0, static_cast<double>(most * settings_.tck_ps) / period_ps, true}};
}

namespace {

Implementation implementation(const char* name, const char* description, const DramDevice& device) {
  Implementation made;
  made.slot = "dram";
  made.name = name;
  made.description = description;
  made.trust = Trust::trusted;
  made.make_parameters = [&device] { return std::make_unique<DramParameters>(device); };
  made.make_behaviour = [](const ParameterSet& parameters, const RenderContext& context) {
    return std::make_unique<Dram>(dynamic_cast<const DramParameters&>(parameters), context);
  };
  return made;
}

const EffectRegistrar accesses_effect{{"dram",
                                       "accesses",
                                       "",
                                       EffectKind::timing,
                                       "the DRAM: rows, banks, queues and buses of its channels",
                                       "there is no time (functional)",
                                       "the DRAM",
                                       "none is needed: without it nothing of a frame's result asks for it",
                                       {"dram"},
                                       [](const EffectQuestion& asked) {
                                         if (!asked.counts_work)
                                           return EffectDecision::omit("without time nothing waits for it");
                                         return EffectDecision::keep("what the cache above has never held, is fetched");
                                       }}};
const EffectRegistrar refresh_effect{
    {"dram",
     "refresh",
     "",
     EffectKind::timing,
     "refreshes, in which a channel does nothing else",
     "dram.refresh=off, or until the first falls due; at `bound`, approximately: their share of the time",
     "nothing: it takes a comparison to know",
     "at the first refresh",
     {},
     [](const EffectQuestion& asked) {
       const auto* const parameters = dynamic_cast<const DramParameters*>(&asked.parameters);
       if (!asked.counts_work) return EffectDecision::omit("there is no time at this fidelity");
       if (parameters == nullptr) return EffectDecision::keep("the DRAM is not of this library");
       const DramParameters& dram = *parameters;
       if (!dram.refresh) return EffectDecision::omit("dram.refresh=off");
       const double us = 1e-6 * static_cast<double>(dram.trefi_ps);
       if (asked.has_time) return EffectDecision::watch(fmt::format("every {:.3g} us", us));
       const double share = 100.0 * static_cast<double>(dram.trfc_ps) / static_cast<double>(dram.trefi_ps);
       return EffectDecision::bound(fmt::format("at most {:.2g} % of the cycles: {:.3g} us in each {:.3g} us", share,
                                                1e-6 * static_cast<double>(dram.trfc_ps), us));
     }}};

const SlotRegistrar dram_slot{{"dram", 120, "lpddr3-1600", "", true, nullptr, true}};

[[maybe_unused]] const bool dram_registered = [] {
  Registry::instance().add(
      implementation("lpddr3-1600", "16 channels of LPDDR3-1600, the paper's: 102.4 GB/s", lpddr3_1600));
  Registry::instance().add(
      implementation("lpddr5-6400", "16 channels of LPDDR5-6400, the Jetson AGX Orin's: 204.8 GB/s", lpddr5_6400));
  return true;
}();

// Not decided: why stands in place of a predicate.
const EffectRegistrar bank_conflicts_effect{{"dram",
                                             "bank_conflicts",
                                             "",
                                             EffectKind::timing,
                                             "a row has to be closed before another of its bank is opened",
                                             "which rows are open depends on the order of requests in time",
                                             "the state of each bank",
                                             "",
                                             {},
                                             nullptr}};
}  // namespace

}  // namespace vrpipe
