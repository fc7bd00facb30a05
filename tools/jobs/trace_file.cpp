#include "jobs/trace_file.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "host/output_file.h"

namespace vrpipe::tools {
namespace {

std::string json_text(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string text_of_time(std::uint64_t picoseconds) {
  return fmt::format("{}.{:06}", picoseconds / 1000000, picoseconds % 1000000);
}

}  // namespace

TraceFile::TraceFile(const std::filesystem::path& path, const std::string& option, double frequency_mhz,
                     const nlohmann::json& about)
    : picoseconds_(1e6 / frequency_mhz), file_(path, option) {
  const std::string head =
      R"({"displayTimeUnit":"ns","otherData":)" + json_text(about) + ",\n" + R"("traceEvents":[)" + "\n";
  file_.write(head.data(), head.size());
}

std::uint64_t TraceFile::picoseconds(Cycle cycle) const {
  return static_cast<std::uint64_t>(std::llround(picoseconds_ * static_cast<double>(cycle)));
}

void TraceFile::write(const std::string& event) {
  const std::string text = (is_first_ ? "" : ",\n") + event;
  is_first_ = false;
  file_.write(text.data(), text.size());
}

void TraceFile::name_group(unsigned group, const std::string& name) {
  write(fmt::format(R"({{"ph":"M","name":"process_name","pid":{},"args":{{"name":{}}}}})", group, json_text(name)));
  write(fmt::format(R"({{"ph":"M","name":"process_sort_index","pid":{},"args":{{"sort_index":{}}}}})", group, group));
}

void TraceFile::name_track(Track track, const std::string& name) {
  write(fmt::format(R"({{"ph":"M","name":"thread_name","pid":{},"tid":{},"args":{{"name":{}}}}})", track.group,
                    track.row, json_text(name)));
  write(fmt::format(R"({{"ph":"M","name":"thread_sort_index","pid":{},"tid":{},"args":{{"sort_index":{}}}}})",
                    track.group, track.row, track.row));
}

void TraceFile::slice(Track track, const std::string& name, Cycle from, Cycle until) {
  write(fmt::format(R"({{"ph":"X","name":"{}","pid":{},"tid":{},"ts":{},"dur":{},"args":{{"cycle":{},"cycles":{}}}}})",
                    name, track.group, track.row, text_of_time(picoseconds(from)),
                    text_of_time(picoseconds(until) - picoseconds(from)), from, until - from));
}

void TraceFile::instant(Track track, const std::string& name, Cycle at, nlohmann::json arguments) {
  arguments["cycle"] = at;
  write(fmt::format(R"({{"ph":"i","s":"t","name":"{}","pid":{},"tid":{},"ts":{},"args":{}}})", name, track.group,
                    track.row, text_of_time(picoseconds(at)), json_text(arguments)));
}

void TraceFile::counter(unsigned group, const std::string& name, const std::string& unit, Cycle at,
                        std::int64_t value) {
  write(fmt::format(R"({{"ph":"C","name":{},"pid":{},"ts":{},"args":{{"{}":{}}}}})", json_text(name), group,
                    text_of_time(picoseconds(at)), unit, value));
}

void TraceFile::commit() {
  const std::string tail = "\n]}\n";
  file_.write(tail.data(), tail.size());
  file_.commit();
}

}  // namespace vrpipe::tools
