#pragma once

#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include <vrpipe/platforms/software.h>

namespace vrpipe::testing {

inline std::uint64_t software_statistic(const SoftwareResult& result, const std::string& name) {
  for (const StatisticReport& report : result.statistics) {
    if (report.name == name) return report.value;
  }
  ADD_FAILURE() << "no statistic " << name;
  return 0;
}

}  // namespace vrpipe::testing
