#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>

#include "host/output_file.h"
#include "jobs/cycle_window.h"

namespace vrpipe::tools {

/// What units do in one run, a line an event: states that they enter, and what passes their links. Observers alone: text
/// is made for what is logged, and units that are not are not looked at.
class EventLog {
 public:
  struct Choice {
    std::string unit;  ///< gpc0.crop, or of all GPCs: crop
    CycleWindow window;
  };
  static constexpr const char* option = "--log";
  static constexpr const char* file_option = "--log-file";

  /// @param file  none: stderr
  EventLog(std::vector<Choice> choices, std::optional<std::filesystem::path> file);

  const std::optional<std::filesystem::path>& file() const { return path_; }
  /// Adds its observers; it has to live while they are called. Throws UserError for a unit that is not there.
  void attach(const RunRequest& request, Observers& observers);
  /// After the run, where there is one: the file appears. Throws UserError.
  void finish();

 private:
  /// What one unit is logged for.
  struct Logged {
    std::string unit;
    std::vector<CycleWindow> windows;
    bool wants(Cycle cycle) const;
  };
  Logged* logged(const std::string& unit);
  /// Throws UserError for one that begins after the end of the run.
  void check_windows(Cycle cycles) const;
  void write(Cycle cycle, const std::string& unit, const std::string& what);
  void open();

  const std::vector<Choice> choices_;
  const std::optional<std::filesystem::path> path_;
  std::unique_ptr<CourseFile> out_;
  std::vector<std::unique_ptr<Logged>> logged_;
};

}  // namespace vrpipe::tools
