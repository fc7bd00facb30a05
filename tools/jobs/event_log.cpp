#include "jobs/event_log.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "jobs/link_items.h"

namespace vrpipe::tools {
namespace {

[[noreturn]] void refuse_log(const std::string& unit, const Netlist& netlist) {
  std::vector<std::string> names;
  bool is_memory = netlist.has_foreign(unit);
  for (const Instance& instance : netlist.instances()) {
    if (Netlist::is_memory(instance)) {
      is_memory = is_memory || names_path(unit, instance.path);
      continue;
    }
    names.push_back(instance.path);
    names.push_back(without_gpc(instance.path));
  }
  throw UserError("cannot log '" + unit + "'", EventLog::option,
                  is_memory ? "a memory has no states and no links" : "the platform has no such unit",
                  is_memory ? "log the units that ask it, such as crop"
                            : suggestion(unit, names, "`vrpipe units` lists all"));
}

}  // namespace

EventLog::EventLog(std::vector<Choice> choices, std::optional<std::filesystem::path> file)
    : choices_(std::move(choices)), path_(std::move(file)) {}

bool EventLog::Logged::wants(Cycle cycle) const {
  return std::any_of(windows.begin(), windows.end(), [&](const CycleWindow& each) { return each.contains(cycle); });
}

EventLog::Logged* EventLog::logged(const std::string& unit) {
  for (const auto& each : logged_) {
    if (each->unit == unit) return each.get();
  }
  return nullptr;
}

void EventLog::attach(const RunRequest& request, Observers& observers) {
  const Netlist netlist = netlist_of(request);
  for (const Choice& choice : choices_) {
    bool found = false;
    for (const Instance& instance : netlist.instances()) {
      if (Netlist::is_memory(instance) || !names_path(choice.unit, instance.path)) continue;
      found = true;
      if (logged(instance.path) == nullptr) logged_.push_back(std::make_unique<Logged>(Logged{instance.path, {}}));
      logged(instance.path)->windows.push_back(choice.window);
    }
    if (!found) refuse_log(choice.unit, netlist);
  }
  observers.on_end([this](const RunResult& result) { check_windows(result.cycles.value_or(0)); });
  observers.on_states([this](const std::string& unit, UnitState state, Cycle from) {
    const Logged* const of_unit = logged(unit);
    if (of_unit != nullptr && of_unit->wants(from)) write(from, unit, std::string("state ") + vrpipe::name_of(state));
  });
  for (const Link& link : netlist.links()) {
    const Logged* const sender = logged(split_port(link.from).first);
    const Logged* const receiver = logged(split_port(link.to).first);
    if (sender == nullptr && receiver == nullptr) continue;
    on_any_item(observers, link.name(), [this, sender, receiver](const auto& passed) {
      const bool is_sent = sender != nullptr && sender->wants(passed.first);
      const bool is_received = receiver != nullptr && receiver->wants(passed.first);
      if (!is_sent && !is_received) return;
      std::string text = passed.link + ": " + text_of(passed.item);
      if (passed.last != passed.first) text += fmt::format(", until {}", passed.last);
      if (is_sent) write(passed.first, sender->unit, "out " + text);
      if (is_received) write(passed.first, receiver->unit, "in " + text);
    });
  }
}

void EventLog::check_windows(Cycle cycles) const {
  for (const Choice& choice : choices_)
    choice.window.check_begun(cycles, "nothing to log", fmt::format("{} {}", option, choice.unit));
}

void EventLog::open() {
  if (path_ && out_ == nullptr) out_ = std::make_unique<CourseFile>(*path_, file_option);
}

void EventLog::write(Cycle cycle, const std::string& unit, const std::string& what) {
  const std::string line = fmt::format("{:>10} {} {}\n", cycle, unit, what);
  open();
  if (out_ != nullptr) {
    out_->write(line.data(), line.size());
  } else {
    std::fputs(line.c_str(), stderr);
  }
}

void EventLog::finish() {
  open();
  out_->commit();
}

}  // namespace vrpipe::tools
