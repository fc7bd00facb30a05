#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>

#include "file_io.h"

namespace vrpipe::tools {

/// A CSV file of statistics in the course of one run: a column of cycles, then one for each statistic (of a histogram
/// two, NAME.count and NAME.sum). A row says what was counted up to its cycle; a cell is empty where there is no value
/// yet.
class Trace {
 public:
  /// @param every  cycles between rows, at least 1
  /// @param names  as Observers::on_statistics takes them
  Trace(std::filesystem::path path, Cycle every, const std::vector<std::string>& names);

  const std::filesystem::path& path() const { return path_; }
  /// For the request of the run, during which this has to live.
  const std::shared_ptr<Observers>& observers() const { return observers_; }
  /// After the run: the file appears. Throws UserError, as writing does during the run.
  void finish();

  static constexpr const char* option = "--trace";
  static constexpr Cycle default_every = 1000;
  /// What to trace where nothing is named: where quads go, and what CROP moves, as far as a run of the request has it.
  static std::vector<std::string> default_names(const RunRequest& request);

 private:
  void write(Cycle cycle, const std::vector<Observers::Sampled>& values);

  const std::filesystem::path path_;
  std::shared_ptr<Observers> observers_;
  std::unique_ptr<AtomicFile> file_;  ///< from the first row on
};

}  // namespace vrpipe::tools
