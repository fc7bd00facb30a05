#include "l2/fixed_latency.h"

#include <string>

#include <gtest/gtest.h>

namespace vrpipe {
namespace {

TEST(FixedLatency, RefusesSlicesThatTakeNoTime) {
  FixedLatency::Parameters parameters;
  parameters.set("l2", "latency_cycles", "100");
  parameters.set("l2", "slice_spread_cycles", "99");
  EXPECT_EQ(FixedLatency(parameters, RenderContext()).latency().least(), 1U);
  parameters.set("l2", "slice_spread_cycles", "100");
  try {
    FixedLatency(parameters, RenderContext());
    FAIL();
  } catch (const UserError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("unusable L2 (l2.slice_spread_cycles): the nearest slices would take 100 cycles less than 100"),
              std::string::npos)
        << what;
  }
}

}  // namespace
}  // namespace vrpipe
