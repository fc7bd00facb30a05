#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/kernel/accounting.h>

#include "host/output_file.h"

namespace vrpipe::tools {

/// A file of Chrome's trace events, which Perfetto opens, written as it comes. Times are those of a clock, in
/// microseconds; what has arguments has its cycles among them.
class TraceFile {
 public:
  /// A row of the timeline, of a group of rows.
  struct Track {
    unsigned group = 0;
    unsigned row = 0;
  };

  /// @param about  of the run, for whoever reads the file
  TraceFile(const std::filesystem::path& path, const std::string& option, double frequency_mhz,
            const nlohmann::json& about);

  void name_group(unsigned group, const std::string& name);
  void name_track(Track track, const std::string& name);
  /// @param until  excluded
  void slice(Track track, const std::string& name, Cycle from, Cycle until);
  void instant(Track track, const std::string& name, Cycle at, nlohmann::json arguments);
  /// From a cycle on.
  void counter(unsigned group, const std::string& name, const std::string& unit, Cycle at, std::int64_t value);
  /// The file appears. Throws UserError where it cannot be written.
  void commit();

 private:
  /// Since the beginning, whole picoseconds: so what ends where another begins does not overlap it by rounding.
  std::uint64_t picoseconds(Cycle cycle) const;
  void write(const std::string& event);

  const double picoseconds_;  ///< of a cycle
  CourseFile file_;
  bool is_first_ = true;
};

}  // namespace vrpipe::tools
