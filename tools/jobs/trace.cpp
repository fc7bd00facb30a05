#include "jobs/trace.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>

#include "jobs/link_items.h"

namespace vrpipe::tools {
namespace {

/// How much later than it happens something may be told: at `lt` a vertex warp leads to all at once.
Cycle lateness_of(Fidelity fidelity) { return fidelity == Fidelity::cycle ? 0 : 65536; }

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Those of the front end are in the first.
constexpr unsigned first_group = 1;

}  // namespace

Trace::Trace(std::filesystem::path path, CycleWindow window, Cycle every, std::string scene)
    : path_(std::move(path)), window_(window), every_(every), scene_(std::move(scene)) {}

unsigned Trace::group_of(const std::string& path) const {
  for (const Instance& instance : netlist_->instances()) {
    const bool is_of = path == instance.path || path.rfind(instance.path + ".", 0) == 0;
    if (is_of) return instance.in_front_end ? first_group : first_group + 1 + instance.gpc;
  }
  return first_group;
}

void Trace::attach(const RunRequest& request, Observers& observers) {
  request_ = request;
  request_.observers = nullptr;
  netlist_ = netlist_of(request);
  add_units();
  add_links(observers);
  const std::vector<std::string> there = sampled_statistics(request_);
  add_statistics(there);
  std::vector<std::string> names;
  for (const StatisticCounter& each : statistics_) {
    names.push_back(each.plus);
    if (!each.minus.empty()) names.push_back(each.minus);
  }
  // Also without any: samples tell how long the run lasts at least.
  observers.on_statistics(every_, names, [this](Cycle cycle, const std::vector<Observers::Sampled>& values) {
    sample(cycle, values);
  });
  observers.on_states([this](const std::string& unit, UnitState state, Cycle from) {
    const auto found = units_.find(unit);
    if (found != units_.end()) enter(found->second, state, from);
  });
  observers.on_end([this](const RunResult& result) { end(result); });
}

void Trace::add_units() {
  for (const Instance& instance : netlist_->instances()) {
    if (Netlist::is_memory(instance)) continue;
    const TraceFile::Track track{group_of(instance.path), static_cast<unsigned>(tracks_.size()) + 1};
    units_[instance.path].track = track;
    tracks_.emplace_back(instance.path, track);
  }
}

void Trace::add_links(Observers& observers) {
  std::set<std::string> links;
  for (const Link& link : netlist_->links()) {
    links.insert(link.name());
    const std::string receiver = split_port(link.to).first;
    LevelCounter& queue = add_level(group_of(receiver), "queue " + link.name(), "places");
    // At first all places become free.
    const auto see_places = [&queue, is_first = true](const std::string&, std::int64_t places, Cycle at) mutable {
      if (!std::exchange(is_first, false)) queue.level.change(at, places);
    };
    on_any_item(
        observers, link.name(), [](const auto&) {}, see_places);
  }
  for (const Instance& instance : netlist_->instances()) {
    if (instance.slot == "tc" && links.count(instance.path + ".bins") > 0) {
      add_bins(instance.path + ".bins", observers);
    }
    const std::string gpc = instance.path.substr(0, instance.path.rfind('.') + 1);
    if (instance.slot == "sm" && links.count(gpc + "qru.warps") > 0 && links.count(gpc + "prop.release") > 0) {
      add_warps(gpc, observers);
    }
  }
}

void Trace::add_bins(const std::string& link, Observers& observers) {
  const TraceFile::Track track{group_of(link), static_cast<unsigned>(tracks_.size()) + 1};
  tracks_.emplace_back(link, track);
  const auto show_bin = [this, track](Cycle at, TileId tile, std::uint64_t quads, const char* reason) {
    if (!window_.contains(at)) return;
    nlohmann::json arguments{{"tile", fmt::format("{},{}", tile.x, tile.y)}, {"quads", quads}};
    if (reason != nullptr) arguments["flushed"] = reason;
    file().instant(track, "bin", at, std::move(arguments));
  };
  observers.on_link<BinItem>(link, [show_bin](const Observers::Passed<BinItem>& passed) {
    const BinItem& bin = passed.item;
    if (bin.mark != Mark::none) return;
    show_bin(passed.first, bin.tile, bin.quads, bin.storage ? name_of(bin.storage->flush.reason) : nullptr);
  });
  observers.on_link<QuadBeat>(link,
                              [show_bin, quads = std::uint64_t{0}](const Observers::Passed<QuadBeat>& passed) mutable {
                                quads += passed.item.count;
                                if (!passed.item.last_of_bin || passed.item.mark != Mark::none) return;
                                show_bin(passed.first, passed.item.tile, std::exchange(quads, 0), nullptr);
                              });
}

void Trace::add_warps(const std::string& gpc, Observers& observers) {
  const std::string link = gpc + "qru.warps";
  const TraceFile::Track track{group_of(link), static_cast<unsigned>(tracks_.size()) + 1};
  tracks_.emplace_back(link, track);
  LevelCounter& warps = add_level(track.group, "fragment warps in flight", "warps");
  observers.on_link<Warp>(link, [this, track, &warps](const Observers::Passed<Warp>& passed) {
    const Warp& warp = passed.item;
    if (warp.mark != Mark::none) return;
    warps.level.change(passed.first, 1);
    if (!window_.contains(passed.first)) return;
    file().instant(track, "warp", passed.first,
                   {{"sequence", warp.sequence},
                    {"tile", fmt::format("{},{}", warp.tile.x, warp.tile.y)},
                    {"quads", warp.count}});
  });
  observers.on_link<WarpRelease>(gpc + "prop.release", [&warps](const Observers::Passed<WarpRelease>& passed) {
    // A mark has no slot.
    if (passed.item.slot != no_slot) warps.level.change(passed.first, -1);
  });
}

Trace::LevelCounter& Trace::add_level(unsigned group, const std::string& name, const std::string& unit) {
  levels_.push_back({{group, name, unit}, Level(every_)});
  return levels_.back();
}

void Trace::add_statistics(const std::vector<std::string>& there) {
  const auto is_there = [&](const std::string& name) {
    return std::find(there.begin(), there.end(), name) != there.end();
  };
  for (const Instance& instance : netlist_->instances()) {
    const std::string begun = instance.path + ".bins_begun", flushed = instance.path + ".flushes";
    if (is_there(begun) && is_there(flushed)) {
      statistics_.push_back({{group_of(instance.path), instance.path + " bins in use", "bins"}, begun, flushed});
    }
    if (!Netlist::is_memory(instance)) continue;
    for (const std::string& name : there) {
      const bool is_traffic = ends_with(name, "bytes_read") || ends_with(name, "bytes_written");
      if (!is_traffic || name.rfind(instance.path + ".", 0) != 0) continue;
      statistics_.push_back({{group_of(instance.path), name, "bytes"}, name, ""});
    }
  }
}

TraceFile& Trace::file() {
  if (file_ != nullptr) return *file_;
  const Platform& platform = *request_.platform;
  nlohmann::json about{
      {"platform", platform.name}, {"variant", request_.variant.name},        {"fidelity", fidelity_of(request_)},
      {"scene", scene_},           {"frequency_mhz", platform.frequency_mhz}, {"cycles_between_counters", every_},
      {"from_cycle", window_.from}};
  if (window_.to != never) about["to_cycle"] = window_.to;
  file_ = std::make_unique<TraceFile>(path_, option, platform.frequency_mhz, about);
  const std::string title = platform.name + " " + request_.variant.name;
  file_->name_group(first_group, title + ", front end and memory");
  for (unsigned gpc = 0; gpc < netlist_->gpcs(); ++gpc) {
    file_->name_group(first_group + 1 + gpc, fmt::format("{}, gpc{}", title, gpc));
  }
  for (const auto& [name, track] : tracks_) file_->name_track(track, name);
  return *file_;
}

void Trace::enter(UnitTrack& unit, UnitState state, Cycle from) const {
  const Slice slice{unit.state, std::max(unit.since, window_.from), std::min(from, window_.to)};
  if (slice.from < slice.until) unit.held.push_back(slice);
  unit.state = state;
  unit.since = from;
}

void Trace::sample(Cycle cycle, const std::vector<Observers::Sampled>& values) {
  std::size_t next = 0;
  for (StatisticCounter& each : statistics_) {
    const auto plus = static_cast<std::int64_t>(values[next++].value.value_or(0));
    if (each.minus.empty()) {
      // Of the cycles since the sample before.
      show(each.counter, sampled_, plus - each.before);
      each.before = plus;
    } else {
      show(each.counter, cycle, plus - static_cast<std::int64_t>(values[next++].value.value_or(0)));
    }
  }
  sampled_ = cycle;
  const Cycle lateness = lateness_of(request_.fidelity);
  write_before(cycle, cycle - std::min(cycle, lateness));
}

void Trace::write_before(Cycle cycle, Cycle of_levels) {
  for (auto& [name, unit] : units_) {
    for (; !unit.held.empty() && unit.held.front().until <= cycle; unit.held.pop_front()) {
      const Slice& slice = unit.held.front();
      file().slice(unit.track, vrpipe::name_of(slice.state), slice.from, slice.until);
    }
  }
  for (LevelCounter& each : levels_) {
    each.level.give_before(of_levels, [&](Cycle at, std::int64_t level) { show(each.counter, at, level); });
  }
}

void Trace::show(Counter& counter, Cycle cycle, std::int64_t value) {
  if (value == counter.value || cycle >= window_.to) return;
  if (cycle > window_.from) begin(counter);
  counter.value = value;
  if (cycle < window_.from) return;
  counter.is_begun = true;
  file().counter(counter.group, counter.name, counter.unit, cycle, value);
}

void Trace::begin(Counter& counter) {
  if (std::exchange(counter.is_begun, true) || counter.value == 0) return;
  file().counter(counter.group, counter.name, counter.unit, window_.from, counter.value);
}

void Trace::end(const RunResult& result) {
  const Cycle cycles = result.cycles.value_or(0);
  window_.check_begun(cycles, "nothing to trace", fmt::format("{} {}", option, path_.string()));
  for (auto& [name, unit] : units_) {
    enter(unit, unit.state, std::max(unit.since, cycles));
    for (Slice& slice : unit.held) slice.until = std::min(slice.until, cycles);
    const auto is_after = [](const Slice& slice) { return slice.from >= slice.until; };
    unit.held.erase(std::remove_if(unit.held.begin(), unit.held.end(), is_after), unit.held.end());
  }
  write_before(cycles, cycles);
  for (LevelCounter& each : levels_) begin(each.counter);
  for (StatisticCounter& each : statistics_) begin(each.counter);
}

void Trace::finish() { file().commit(); }

}  // namespace vrpipe::tools
