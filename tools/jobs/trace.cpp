#include "jobs/trace.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "host/output_file.h"
#include "host/process_setup.h"

namespace vrpipe::tools {
namespace {

std::string text_of(const std::optional<std::uint64_t>& value) { return value ? fmt::format("{}", *value) : ""; }

std::string head_of(const Observers::Sampled& sampled) {
  if (sampled.kind != "histogram") return sampled.name;
  return sampled.name + ".count," + sampled.name + ".sum";
}

std::string cell_of(const Observers::Sampled& sampled) {
  if (sampled.kind == "histogram") return text_of(sampled.denominator) + "," + text_of(sampled.value);
  if (sampled.kind == "ratio") return sampled.quotient() ? fmt::format("{:.6g}", *sampled.quotient()) : "";
  return text_of(sampled.value);
}

}  // namespace

Trace::Trace(std::filesystem::path path, Cycle every, const std::vector<std::string>& names)
    : path_(std::move(path)), observers_(std::make_shared<Observers>()) {
  observers_->on_statistics(every, names, [this](Cycle cycle, const std::vector<Observers::Sampled>& values) {
    write(cycle, values);
  });
}

std::vector<std::string> Trace::default_names(const RunRequest& request) {
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

void Trace::write(Cycle cycle, const std::vector<Observers::Sampled>& values) {
  std::string text;
  if (file_ == nullptr) {
    file_ = open_output_file(path_, option);
    text = "cycle";
    for (const Observers::Sampled& value : values) text += "," + head_of(value);
    text += "\n";
  }
  text += fmt::format("{}", cycle);
  for (const Observers::Sampled& value : values) text += "," + cell_of(value);
  text += "\n";
  file_->write(text.data(), text.size());
}

void Trace::finish() {
  file_->commit();
  note_written(path_.string());
}

}  // namespace vrpipe::tools
