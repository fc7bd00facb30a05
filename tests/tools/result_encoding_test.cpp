#include "jobs/result_encoding.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>

#include "support/refusals.h"

namespace vrpipe::tools {
namespace {

using Json = nlohmann::json;
using Shares = std::vector<std::pair<std::string, double>>;
constexpr double denormal = std::numeric_limits<double>::denorm_min();

RunRequest a_request() {
  RunRequest request;
  request.platform = &platforms().back();
  request.variant = variants().back();
  request.fidelity = Fidelity::lt;
  request.settings = {{"tc", "bins", "8"}};
  return request;
}

/// A result without a field that has its default value, or the value of another.
RunResult full_result() {
  constexpr std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();  // no double has it
  RunResult result;
  result.request = a_request();
  result.cycles = huge;
  result.stopped = true;
  result.milliseconds = 0.1;
  result.host_seconds = 1.0 / 3;
  result.cpu_seconds = 12345678.901234567;
  std::array<std::uint64_t, sizeof(Counts) / sizeof(std::uint64_t)> counts{};
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = huge - 1 - i;
  std::memcpy(static_cast<void*>(&result.counts), counts.data(), sizeof counts);
  result.utilization = {{"raster", 0.25}, {"zrop", denormal}, {"prop", -0.0}};
  UnitReport unit;
  unit.name = "gpc0.crop";
  for (std::size_t i = 0; i < unit.cycles.size(); ++i) unit.cycles[i] = (std::uint64_t{1} << 53) + 1 + i;
  unit.occupancy = 0.75;
  unit.parts = {{"blend", 0.5}, {"sectors", 0.125}};
  result.units = {unit, {}};
  result.bottleneck = {"l2", 0.625, {{"reads", 0.375}}};
  result.kernels = {{"sort", huge - 4, 24, huge - 5, "memory", 25, huge - 6, 0.1, denormal, 26.5}};
  result.statistics.resize(2);
  StatisticReport& statistic = result.statistics.front();
  statistic.name = "crop.hits";
  statistic.unit = "sectors";
  statistic.meaning = "found in the \"cache\"\n";
  statistic.value = 7;
  statistic.kind = "histogram";
  statistic.formula = "hits / accesses";
  statistic.denominator = huge - 100;
  statistic.histogram = HistogramReport{10, huge - 101, {{12, 13, 14}, {16, std::nullopt, 17}}};
  statistic.instances = {{"gpc0.crop", 18, 19}, {"gpc1.crop", 20, std::nullopt}};
  result.statistics.back().meaning = "µ";
  result.implementations = {{"qru", "caf\xe9"}, {"tc", std::string("\0\xff", 2)}};
  result.parameters = {{"tc.bins", "32"}, {"state.exponential", "exact"}};
  result.outside_validated_range = {"\xc3", ""};
  result.expected_error_percent = 0.1 + 0.2;
  result.sampling = SamplingReport{26, huge - 4, 0.1, 0.2, 1.0 / 3, 1.0 / 7, 1.0 / 9, "queues"};
  result.way = WayReport{"sampled", "\xe9"};
  result.result_hash = "0123456789abcdef";
  result.kernel_events = 9;
  result.framebuffer.addresses.attributes = {0x10000, 123};
  result.effects = {{"crop.blend_hazard", true, EffectProof::verified, "\xe9"},
                    {"tc.time_out", false, EffectProof::bounded, "after 150 cycles"}};
  result.draws = {{"first", {{"quads_blended", 7}}, huge - 2, 8}, {"", {}, std::nullopt, std::nullopt}};
  IntervalReport& intervals = result.intervals.emplace();
  intervals.every = huge - 3;
  intervals.from = {0, huge - 3};
  intervals.units = {{"gpc0.crop", {}}};
  intervals.units.front().cycles[1] = {huge, 21};
  intervals.statistics = {{"crop.hits", "ratio", {22, std::nullopt}, {23, huge}}, {}};
  return result;
}

void expect_equal_units(const UnitReport& actual, const UnitReport& expected) {
  const auto& [name, cycles, occupancy, parts] = actual;
  EXPECT_EQ(name, expected.name);
  EXPECT_EQ(cycles, expected.cycles);
  EXPECT_EQ(occupancy, expected.occupancy);
  EXPECT_EQ(parts, expected.parts);
}

void expect_equal_histograms(const HistogramReport& actual, const HistogramReport& expected) {
  const auto& [smallest, largest, buckets] = actual;
  EXPECT_EQ(smallest, expected.smallest);
  EXPECT_EQ(largest, expected.largest);
  ASSERT_EQ(buckets.size(), expected.buckets.size());
  for (std::size_t i = 0; i < buckets.size(); ++i) {
    const auto& [from, to, count] = buckets[i];
    EXPECT_EQ(from, expected.buckets[i].from);
    EXPECT_EQ(to, expected.buckets[i].to);
    EXPECT_EQ(count, expected.buckets[i].count);
  }
}

void expect_equal_statistics(const StatisticReport& actual, const StatisticReport& expected) {
  const auto& [name, unit, meaning, value, kind, formula, denominator, histogram, instances] = actual;
  EXPECT_EQ(name, expected.name);
  EXPECT_EQ(unit, expected.unit);
  EXPECT_EQ(meaning, expected.meaning);
  EXPECT_EQ(value, expected.value);
  EXPECT_EQ(kind, expected.kind);
  EXPECT_EQ(formula, expected.formula);
  EXPECT_EQ(denominator, expected.denominator);
  ASSERT_EQ(histogram.has_value(), expected.histogram.has_value());
  if (histogram) expect_equal_histograms(*histogram, *expected.histogram);
  ASSERT_EQ(instances.size(), expected.instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const auto& [path, value_there, denominator_there] = instances[i];
    EXPECT_EQ(path, expected.instances[i].path);
    EXPECT_EQ(value_there, expected.instances[i].value);
    EXPECT_EQ(denominator_there, expected.instances[i].denominator);
  }
}

void expect_equal_intervals(const IntervalReport& actual, const IntervalReport& expected) {
  const auto& [every, from, units, statistics] = actual;
  EXPECT_EQ(every, expected.every);
  EXPECT_EQ(from, expected.from);
  ASSERT_EQ(units.size(), expected.units.size());
  for (std::size_t i = 0; i < units.size(); ++i) {
    const auto& [name, cycles] = units[i];
    EXPECT_EQ(name, expected.units[i].name);
    EXPECT_EQ(cycles, expected.units[i].cycles);
  }
  ASSERT_EQ(statistics.size(), expected.statistics.size());
  for (std::size_t i = 0; i < statistics.size(); ++i) {
    const auto& [name, kind, values, denominators] = statistics[i];
    EXPECT_EQ(name, expected.statistics[i].name);
    EXPECT_EQ(kind, expected.statistics[i].kind);
    EXPECT_EQ(values, expected.statistics[i].values);
    EXPECT_EQ(denominators, expected.statistics[i].denominators);
  }
}

/// All but the request and the surfaces. A new member has to be named here, and compared.
void expect_equal(const RunResult& actual, const RunResult& expected) {
  const auto& [request, cycles, stopped, milliseconds, host_seconds, cpu_seconds, counts, utilization, units,
               bottleneck, kernels, statistics, implementations, parameters, outside_validated_range,
               expected_error_percent, effects, sampling, way, result_hash, kernel_events, framebuffer, draws,
               intervals] = actual;
  ASSERT_EQ(sampling.has_value(), expected.sampling.has_value());
  if (sampling) {
    const auto& [windows, seed, measured_share, warm_up_share, half_interval_percent, delay_growth_percent,
                 lead_growth_percent, whole_because] = *sampling;
    EXPECT_EQ(windows, expected.sampling->windows);
    EXPECT_EQ(seed, expected.sampling->seed);
    EXPECT_EQ(measured_share, expected.sampling->measured_share);
    EXPECT_EQ(warm_up_share, expected.sampling->warm_up_share);
    EXPECT_EQ(half_interval_percent, expected.sampling->half_interval_percent);
    EXPECT_EQ(delay_growth_percent, expected.sampling->delay_growth_percent);
    EXPECT_EQ(lead_growth_percent, expected.sampling->lead_growth_percent);
    EXPECT_EQ(whole_because, expected.sampling->whole_because);
  }
  ASSERT_EQ(way.has_value(), expected.way.has_value());
  if (way) {
    const auto& [fidelity, why] = *way;
    EXPECT_EQ(fidelity, expected.way->fidelity);
    EXPECT_EQ(why, expected.way->why);
  }
  ASSERT_EQ(intervals.has_value(), expected.intervals.has_value());
  if (intervals) expect_equal_intervals(*intervals, *expected.intervals);
  EXPECT_EQ(framebuffer.addresses.attributes.address, expected.framebuffer.addresses.attributes.address);
  EXPECT_EQ(framebuffer.addresses.attributes.bytes, expected.framebuffer.addresses.attributes.bytes);
  ASSERT_EQ(draws.size(), expected.draws.size());
  for (std::size_t i = 0; i < draws.size(); ++i) {
    const auto& [name, counts_of_draw, end, cycles_of_draw] = draws[i];
    EXPECT_EQ(end, expected.draws[i].end);
    EXPECT_EQ(cycles_of_draw, expected.draws[i].cycles);
    EXPECT_EQ(name, expected.draws[i].name);
    EXPECT_EQ(counts_of_draw, expected.draws[i].counts);
  }
  ASSERT_EQ(kernels.size(), expected.kernels.size());
  for (std::size_t i = 0; i < kernels.size(); ++i) {
    const auto& [name, items, bytes, cycles_of_kernel, bound_by, sm_cycles, memory_cycles, warp_instructions,
                 lane_instructions, core_cycles] = kernels[i];
    EXPECT_EQ(name, expected.kernels[i].name);
    EXPECT_EQ(items, expected.kernels[i].items);
    EXPECT_EQ(bytes, expected.kernels[i].bytes);
    EXPECT_EQ(cycles_of_kernel, expected.kernels[i].cycles);
    EXPECT_EQ(bound_by, expected.kernels[i].bound_by);
    EXPECT_EQ(sm_cycles, expected.kernels[i].sm_cycles);
    EXPECT_EQ(memory_cycles, expected.kernels[i].memory_cycles);
    EXPECT_EQ(warp_instructions, expected.kernels[i].warp_instructions);
    EXPECT_EQ(lane_instructions, expected.kernels[i].lane_instructions);
    EXPECT_EQ(core_cycles, expected.kernels[i].core_cycles);
  }
  ASSERT_EQ(effects.size(), expected.effects.size());
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const auto& [name, omitted, proof, reason] = effects[i];
    EXPECT_EQ(name, expected.effects[i].name);
    EXPECT_EQ(omitted, expected.effects[i].omitted);
    EXPECT_EQ(proof, expected.effects[i].proof);
    EXPECT_EQ(reason, expected.effects[i].reason);
  }
  EXPECT_EQ(cycles, expected.cycles);
  EXPECT_EQ(stopped, expected.stopped);
  EXPECT_EQ(milliseconds, expected.milliseconds);
  EXPECT_EQ(host_seconds, expected.host_seconds);
  EXPECT_EQ(cpu_seconds, expected.cpu_seconds);
  EXPECT_EQ(std::memcmp(&counts, &expected.counts, sizeof counts), 0);
  EXPECT_EQ(counts.named(), expected.counts.named());
  EXPECT_EQ(utilization, expected.utilization);
  ASSERT_EQ(units.size(), expected.units.size());
  for (std::size_t i = 0; i < units.size(); ++i) expect_equal_units(units[i], expected.units[i]);
  ASSERT_EQ(bottleneck.has_value(), expected.bottleneck.has_value());
  if (bottleneck) {
    const auto& [unit, occupancy, parts] = *bottleneck;
    EXPECT_EQ(unit, expected.bottleneck->unit);
    EXPECT_EQ(occupancy, expected.bottleneck->occupancy);
    EXPECT_EQ(parts, expected.bottleneck->parts);
  }
  ASSERT_EQ(statistics.size(), expected.statistics.size());
  for (std::size_t i = 0; i < statistics.size(); ++i) expect_equal_statistics(statistics[i], expected.statistics[i]);
  EXPECT_EQ(implementations, expected.implementations);
  EXPECT_EQ(parameters, expected.parameters);
  EXPECT_EQ(outside_validated_range, expected.outside_validated_range);
  EXPECT_EQ(expected_error_percent, expected.expected_error_percent);
  EXPECT_EQ(result_hash, expected.result_hash);
  EXPECT_EQ(kernel_events, expected.kernel_events);
}

RunResult through_bytes(const RunResult& result) { return from_bytes(to_bytes(result), result.request); }

/// What is wrong with it; "none" when it is read.
std::string refusal(const Json& json) {
  return testing::refusal_of<std::runtime_error>([&] { decode(json, a_request()); });
}
std::string refusal(const std::string& bytes) {
  return testing::refusal_of<std::runtime_error>([&] { from_bytes(bytes, a_request()); });
}

/// Calls `visit` with every value of a document, which it may change for the time of the call.
void for_each_value(Json& json, const std::function<void(Json&)>& visit) {
  visit(json);
  if (!json.is_structured()) return;
  for (Json& value : json) for_each_value(value, visit);
}

TEST(ResultEncoding, EveryFieldComesBack) {
  expect_equal(through_bytes(full_result()), full_result());
  expect_equal(decode(encode(full_result()), a_request()), full_result());
}

// Two names exchanged would go unnoticed between two ends of the same program, but not in a file.
TEST(ResultEncoding, EveryFieldHasItsOwnName) {
  const RunResult result = full_result();
  const Json json = encode(result);
  for (const auto& [name, value] : result.counts.named()) EXPECT_EQ(json["counts"].value(name, Json()), value) << name;
  EXPECT_EQ(json["counts"].size(), result.counts.named().size());
  EXPECT_EQ(json["cycles"], *result.cycles);
  EXPECT_EQ(json["milliseconds"], result.milliseconds);
  EXPECT_EQ(json["host_seconds"], result.host_seconds);
  EXPECT_EQ(json["cpu_seconds"], result.cpu_seconds);
  EXPECT_EQ(json["utilization"], Json(result.utilization));
  const UnitReport& unit = result.units[0];
  EXPECT_EQ(
      json["units"][0],
      Json({{"name", unit.name}, {"cycles", unit.cycles}, {"occupancy", unit.occupancy}, {"parts", Json(unit.parts)}}));
  const Bottleneck& bottleneck = *result.bottleneck;
  EXPECT_EQ(json["bottleneck"],
            Json({{"unit", bottleneck.unit}, {"occupancy", bottleneck.occupancy}, {"parts", Json(bottleneck.parts)}}));
  const StatisticReport& statistic = result.statistics[0];
  EXPECT_EQ(json["statistics"][0], Json({{"name", statistic.name},
                                         {"unit", statistic.unit},
                                         {"meaning", statistic.meaning},
                                         {"value", statistic.value},
                                         {"kind", statistic.kind},
                                         {"formula", statistic.formula},
                                         {"denominator", *statistic.denominator},
                                         {"histogram", json["statistics"][0]["histogram"]},
                                         {"instances", json["statistics"][0]["instances"]}}));
  EXPECT_EQ(json["statistics"][0]["histogram"]["smallest"], 10U);
  EXPECT_EQ(json["statistics"][0]["histogram"]["largest"], *statistic.histogram->largest);
  EXPECT_EQ(json["statistics"][0]["histogram"]["buckets"][0], Json({{"from", 12U}, {"to", 13U}, {"count", 14U}}));
  EXPECT_EQ(json["statistics"][0]["instances"][0], Json({{"path", "gpc0.crop"}, {"value", 18U}, {"denominator", 19U}}));
  EXPECT_EQ(json["implementations"][0][0], "qru");
  EXPECT_EQ(json["parameters"], Json(result.parameters));
  EXPECT_EQ(json["effects"][1],
            Json({{"name", "tc.time_out"}, {"omitted", false}, {"proof", "bounded"}, {"reason", "after 150 cycles"}}));
  EXPECT_EQ(json["outside_validated_range"][1], "");
  EXPECT_EQ(json["result_hash"], result.result_hash);
  EXPECT_EQ(json["kernel_events"], result.kernel_events);
}

TEST(ResultEncoding, NothingIsAFieldToo) { expect_equal(through_bytes(RunResult()), RunResult()); }

TEST(ResultEncoding, ABottleneckWithoutANameIsOne) {
  RunResult result;
  result.bottleneck.emplace();
  EXPECT_TRUE(through_bytes(result).bottleneck.has_value());
}

TEST(ResultEncoding, DoublesComeBackExactly) {
  for (const double value : {0.0, -0.0, 0.1, denormal, std::numeric_limits<double>::max(), 65504.0, 1e-5,
                             std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    RunResult result;
    result.milliseconds = value;
    const double back = through_bytes(result).milliseconds;
    EXPECT_EQ(back, value);
    EXPECT_EQ(std::signbit(back), std::signbit(value));
  }
  RunResult result;
  result.milliseconds = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(through_bytes(result).milliseconds));
}

TEST(ResultEncoding, TheRequestIsWhatTheReceiverSays) {
  const RunResult result = through_bytes(full_result());
  EXPECT_EQ(result.request.platform, a_request().platform);
  EXPECT_EQ(result.request.variant.name, a_request().variant.name);
  EXPECT_EQ(fidelity_of(result.request), "sampled") << "which the run of it chose";
  RunResult asked = full_result();
  asked.way.reset();
  EXPECT_EQ(through_bytes(asked).request.fidelity, a_request().fidelity);
  EXPECT_EQ(result.request.settings.size(), 1U);
}

// RFC 8949 wants UTF-8 of texts; other bytes are byte strings, so that other programs read the file as well.
TEST(ResultEncoding, TextsThatAreNotUtf8AreBytes) {
  const Json json = encode(full_result());
  EXPECT_TRUE(json["implementations"][0][1].is_binary());
  EXPECT_TRUE(json["statistics"][1]["meaning"].is_string());
  std::size_t texts = 0;
  Json copy = json;
  for_each_value(copy, [&](Json& value) { texts += value.is_string() ? 1U : 0U; });
  EXPECT_GT(texts, 10U);
  EXPECT_NO_THROW(json.dump());
}

TEST(ResultEncoding, WhatIsMissingTooMuchOrOfAnotherTypeIsRefused) {
  ASSERT_EQ(refusal(encode(full_result())), "none");
  EXPECT_EQ(refusal(Json::array()), "a simulation's result cannot be read: result is not what it should be");
  Json json = encode(full_result());
  for_each_value(json, [&](Json& value) {
    const Json good = value;
    // A negative or broken number is no count, and a count no share.
    for (const Json& bad : {good.is_boolean() ? Json(1U) : Json(true), Json(-1),
                            good.is_number_float() ? Json(1U) : Json(1.5), Json({{"x", 1U}})}) {
      value = bad;
      EXPECT_NE(refusal(json), "none") << bad << " in place of " << good;
    }
    if (good.is_object()) {
      for (const auto& member : good.items()) {
        value = good;
        value.erase(member.key());
        EXPECT_NE(refusal(json).find(member.key()), std::string::npos) << refusal(json);
      }
      value = good;
      value["unheard_of"] = 1U;
      EXPECT_NE(refusal(json), "none");
    }
    value = good;
  });
  json["units"][0]["cycles"].push_back(1U);
  EXPECT_NE(refusal(json), "none") << "a unit state too many";
  json = encode(full_result());
  json["effects"][0]["proof"] = "likely";
  EXPECT_NE(refusal(json).find("proof"), std::string::npos) << refusal(json);
}

TEST(ResultEncoding, ADamagedResultIsRefused) {
  const std::string bytes = to_bytes(full_result());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(refusal(bytes.substr(0, size)), "none") << "cut to " << size << " bytes";
  }
  EXPECT_NE(refusal(bytes + '\0'), "none");
  EXPECT_NE(refusal(std::string("a file of something else")), "none");
  EXPECT_NE(refusal(std::string(1000, '\x02')), "none") << "neither there nor not there";
  // Sizes that are not there.
  for (std::size_t at = 0; at + 8 <= bytes.size(); ++at) {
    for (const char last : {'\xff', '\x7f', '\0'}) {
      std::string damaged = bytes;
      damaged.replace(at, 8, std::string(7, '\xff') + last);
      refusal(damaged);
    }
  }
  // Whatever else happens to a byte: a result, or a refusal.
  std::mt19937 random(1);
  for (int i = 0; i < 4000; ++i) {
    std::string damaged = bytes;
    for (auto changes = 1 + random() % 3; changes > 0; --changes) {
      damaged[random() % damaged.size()] = static_cast<char>(random());
    }
    refusal(damaged);
  }
}

}  // namespace
}  // namespace vrpipe::tools
