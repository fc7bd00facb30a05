#include "cli/time_options.h"

#include <algorithm>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/intervals.h>
#include <vrpipe/platforms/software.h>

#include "cli/parse.h"
#include "host/stdout_to_stderr.h"

namespace vrpipe::tools {
namespace {

constexpr const char* until_option = "--until";
constexpr const char* interval_option = "--interval";
constexpr const char* csv_option = "--interval-csv";
constexpr const char* statistics_option = "--interval-statistics";
constexpr unsigned longest_interval = 1'000'000'000;
/// Of a page, which draws as many in one as it has no room for.
constexpr Cycle page_interval = 2048;

/// Where quads go, and what CROP moves, as far as a run of the request has it.
std::vector<std::string> default_statistics(const RunRequest& request) {
  std::vector<std::string> names{"raster.quads_rasterized", "zrop.quads_terminated", "sm.quads_shaded",
                                 "sm.quads_pruned",         "sm.quads_merged",       "crop.quads_blended",
                                 "l2.color_bytes_read",     "l2.color_bytes_written"};
  const std::vector<std::string> there = sampled_statistics(request);
  const auto is_missing = [&](const std::string& name) {
    return std::find(there.begin(), there.end(), name) == there.end();
  };
  names.erase(std::remove_if(names.begin(), names.end(), is_missing), names.end());
  return names;
}

void check_has_time(const SimulationJob& job, const std::string& option) {
  if (has_course(job.requests.front())) return;
  const RunRequest& request = job.requests.front();
  if (request.error_percent > 0) {
    throw UserError("cannot use option", option, "--error takes ways on which it is not known what is when",
                    "use --fidelity lt or cycle in place of --error");
  }
  throw UserError("cannot use option", option,
                  "fidelity " + fidelity_of(request) +
                      (request.fidelity == Fidelity::functional ? " has no time"
                                                                : " knows how long a run takes, but not what is when"),
                  "use lt or cycle");
}

Observers& observers_of(RunRequest& request) {
  if (request.observers == nullptr) request.observers = std::make_shared<Observers>();
  return *request.observers;
}

}  // namespace

void TimeArguments::declare(Arguments& arguments, const std::string& group, bool of_one_run) {
  arguments.add_option(interval_option, interval_, "CYCLES",
                       "states and statistics of each interval of so many cycles, in the JSON, at the\n"
                       "fidelities lt and cycle (docs/time.md)",
                       group);
  arguments.add_option(csv_option, interval_csv_, "FILE.csv", "the same as a table, a row for each interval", group);
  arguments.add_option(statistics_option, interval_statistics_, "NAME,...",
                       "which statistics (default: where quads go, and what CROP moves): over all\n"
                       "GPCs, tc.flushes; of one, gpc1.tc.flushes; several, gpc*.tc.flushes or\n"
                       "'tc.*' (`vrpipe units` lists all)",
                       group);
  if (of_one_run) {
    arguments.add_option(Trace::option, trace_, "FILE[@FROM:TO]",
                         "writes a trace that Perfetto (ui.perfetto.dev) opens, at the same fidelities:\n"
                         "states of units, queues, bins, warps and memory; of the cycles from FROM to\n"
                         "TO - 1 alone; either may be left out",
                         group);
    arguments.add_option(EventLog::option, log_, "UNIT[@FROM:TO]",
                         "writes what a unit does to stderr, a line an event: crop, gpc0.crop; can be\n"
                         "repeated",
                         group);
    arguments.add_option(EventLog::file_option, log_file_, "FILE", "writes it there instead", group);
    arguments.add_option(until_option, until_, "CYCLE",
                         "stops there, with counts, states and picture as they are by then, at fidelity\n"
                         "cycle",
                         group);
  }
  for (const char* option : {interval_option, until_option}) {
    if (Option* const count = arguments.find(option)) {
      count->check = [option](const std::string& text) { parse_count(text, option, longest_interval); };
    }
  }
  for (const char* option : {Trace::option, EventLog::option}) {
    if (Option* const window = arguments.find(option))
      window->check = [option](const std::string& text) { parse_window(text, option); };
  }
  arguments.add_flag(HeatMaps::option, heat_maps_,
                     "with --output: writes maps of the fragments of each pixel and screen tile,\n"
                     "SCENE-VARIANT-pixels-*.png and .exr, -tiles-*.png and .exr",
                     group);
}

std::string TimeArguments::any_of_units() const {
  for (const auto& [values, option] :
       {std::pair{&interval_, interval_option}, std::pair{&interval_csv_, csv_option},
        std::pair{&interval_statistics_, statistics_option}, std::pair{&trace_, Trace::option},
        std::pair{&log_, EventLog::option}, std::pair{&log_file_, EventLog::file_option},
        std::pair{&until_, until_option}}) {
    if (!values->empty()) return option;
  }
  return {};
}

std::string TimeArguments::any_given() const {
  const std::string observing = any_of_units();
  return observing.empty() && heat_maps_ ? HeatMaps::option : observing;
}

std::optional<Cycle> TimeArguments::every() const {
  const auto text = single(interval_, interval_option);
  if (!text) return std::nullopt;
  return parse_count(*text, interval_option, longest_interval);
}

void TimeArguments::record(RunRequest& request, Cycle every) const {
  const auto names = single(interval_statistics_, statistics_option);
  record_intervals(observers_of(request), every,
                   names ? parse_names(*names, statistics_option) : default_statistics(request));
}

void TimeArguments::observe(SimulationJob& job) const {
  const std::optional<Cycle> interval = every();
  const auto csv = single(interval_csv_, csv_option);
  const auto trace = single(trace_, Trace::option);
  const auto log_file = single(log_file_, EventLog::file_option);
  if (!interval && (csv || !interval_statistics_.empty())) {
    throw UserError("no intervals", csv ? csv_option : statistics_option, "nobody says how long they are",
                    "add --interval CYCLES");
  }
  if (interval && !csv && !job.json && !trace && !job.html) {
    throw UserError("intervals go nowhere", interval_option, "they are in the JSON, in a table and in a page",
                    "add --json FILE, --interval-csv FILE.csv or --html FILE");
  }
  if (log_file && log_.empty()) {
    throw UserError("nothing to log", EventLog::file_option, "no unit is named", "add --log UNIT");
  }
  if (heat_maps_ && !job.output) {
    throw UserError("heat maps go nowhere", HeatMaps::option, "no folder is named", "add --output DIR");
  }
  if (const auto until = single(until_, until_option))
    job.requests.front().stop_at = parse_count(*until, until_option, longest_interval);
  job.heat_maps = heat_maps_;
  if (csv) job.interval_csv = *csv;
  const StdoutToStderr redirected;  // plugins may print while their units are made
  if (interval) check_has_time(job, interval_option);
  if (interval && (csv || job.json || job.html)) {
    for (RunRequest& request : job.requests) record(request, *interval);
  } else if (job.html && has_course(job.requests.front()) && !job.explain_effects) {
    job.intervals_for_page = true;
    for (RunRequest& request : job.requests) {
      if (request.variant.is_of_pipeline()) record_intervals(observers_of(request), page_interval, {});
    }
  }
  RunRequest& request = job.requests.front();
  if (trace) {
    check_has_time(job, Trace::option);
    const auto [file, window] = parse_window(*trace, Trace::option);
    job.trace = std::make_shared<Trace>(file, window, interval.value_or(Trace::default_every), job.frame.name);
    job.trace->attach(request, observers_of(request));
  }
  if (!log_.empty()) {
    check_has_time(job, EventLog::option);
    std::vector<EventLog::Choice> choices;
    for (const std::string& text : log_) {
      const auto [unit, window] = parse_window(text, EventLog::option);
      choices.push_back({unit, window});
    }
    job.log = std::make_shared<EventLog>(std::move(choices), log_file);
    job.log->attach(request, observers_of(request));
  }
  for (const RunRequest& each : job.requests) {
    if (each.observers != nullptr || each.stop_at > 0) check_configuration(of_variant_alone(each));
  }
}

}  // namespace vrpipe::tools
