#include "jobs/result_encoding.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

namespace vrpipe::tools {
namespace {

using Record = nlohmann::json;

/// The first of some names, "one, two, three", which is taken off.
std::string_view next_name(std::string_view& names) {
  const std::size_t end = std::min(names.find(','), names.size());
  const std::string_view name = names.substr(0, end);
  names.remove_prefix(std::min(names.find_first_not_of(", ", end), names.size()));
  return name;
}

/// `each_member(value, visit)` calls `visit(name, member)` for every member of a struct. The structured binding does not
/// compile when the struct has a member that is not named here.
#define VRPIPE_MEMBERS(STRUCT, ...)                                                                            \
  template <class Value, class Visit>                                                                          \
  std::enable_if_t<std::is_same<std::remove_const_t<Value>, STRUCT>::value> each_member(Value& value_,         \
                                                                                        const Visit& visit_) { \
    auto& [__VA_ARGS__] = value_;                                                                              \
    visit_all(#__VA_ARGS__, visit_, __VA_ARGS__);                                                              \
  }

template <class Visit, class... Members>
void visit_all(std::string_view names, const Visit& visit, Members&... members) {
  (visit(next_name(names), members), ...);
}

template <class Value, class Visit>
std::enable_if_t<std::is_same<std::remove_const_t<Value>, Counts>::value> each_member(Value& counts,
                                                                                      const Visit& visit) {
  for (const CountField& field : Counts::fields()) visit(field.name, counts.*field.value);
}
VRPIPE_MEMBERS(UnitReport, name, cycles, occupancy, parts)
VRPIPE_MEMBERS(Bottleneck, unit, occupancy, parts)
VRPIPE_MEMBERS(KernelReport, name, items, bytes, cycles, bound_by, sm_cycles, memory_cycles, warp_instructions,
               lane_instructions, core_cycles)
VRPIPE_MEMBERS(HistogramBucket, from, to, count)
VRPIPE_MEMBERS(HistogramReport, smallest, largest, buckets)
VRPIPE_MEMBERS(InstanceStatistic, path, value, denominator)
VRPIPE_MEMBERS(StatisticReport, name, unit, meaning, value, kind, formula, denominator, histogram, instances)
VRPIPE_MEMBERS(MemoryRegion, address, bytes)
VRPIPE_MEMBERS(AddressMap, color, depth_stencil, vertices, primitives, attributes)
VRPIPE_MEMBERS(Framebuffer, color, depth_stencil, addresses)
VRPIPE_MEMBERS(DrawReport, name, counts, end, cycles)
VRPIPE_MEMBERS(EffectReport, name, omitted, proof, reason)
VRPIPE_MEMBERS(UnitIntervals, name, cycles)
VRPIPE_MEMBERS(StatisticIntervals, name, kind, values, denominators)
VRPIPE_MEMBERS(IntervalReport, every, from, units, statistics)
VRPIPE_MEMBERS(WayReport, fidelity, why)
VRPIPE_MEMBERS(SamplingReport, windows, seed, measured_share, warm_up_share, half_interval_percent,
               delay_growth_percent, lead_growth_percent, whole_because)
VRPIPE_MEMBERS(RunResult, request, cycles, stopped, milliseconds, host_seconds, cpu_seconds, counts, utilization, units,
               bottleneck, kernels, statistics, implementations, parameters, outside_validated_range,
               expected_error_percent, effects, sampling, way, result_hash, kernel_events, framebuffer, draws,
               intervals)

/// Types of members that stay behind.
template <class Member>
constexpr bool stays = std::is_same<Member, RunRequest>::value || std::is_same<Member, ColorSurface>::value ||
                       std::is_same<Member, DepthStencilSurface>::value;

struct Writer {
  static Record of(std::uint64_t value) { return value; }
  static Record of(double value) { return value; }
  static Record of(bool value) { return value; }
  static Record of(EffectProof proof) { return name_of(proof); }
  /// CBOR's texts are UTF-8.
  static Record of(const std::string& text) {
    if (valid_utf8(text) == text) return text;
    return Record::binary({text.begin(), text.end()});
  }
  template <class Value>
  static Record of(const std::optional<Value>& value) {
    return value ? of(*value) : Record();
  }
  template <class First, class Second>
  static Record of(const std::pair<First, Second>& pair) {
    return Record::array({of(pair.first), of(pair.second)});
  }
  template <class Value>
  static Record of(const std::vector<Value>& values) {
    return of_all(values);
  }
  template <class Value, std::size_t Size>
  static Record of(const std::array<Value, Size>& values) {
    return of_all(values);
  }
  template <class Struct>
  static Record of(const Struct& value) {
    Record json = Record::object();
    each_member(value, [&](std::string_view name, const auto& member) {
      if constexpr (!stays<std::decay_t<decltype(member)>>) json[std::string(name)] = of(member);
    });
    return json;
  }

 private:
  template <class Values>
  static Record of_all(const Values& values) {
    Record json = Record::array();
    for (const auto& value : values) json.push_back(of(value));
    return json;
  }
};

[[noreturn]] void refuse_record(const std::string& why) {
  throw std::runtime_error("a simulation's result cannot be read: " + why);
}

/// Takes nothing for what it is not: the library would turn any number into any other.
struct Reader {
  static void read(const Record& json, std::uint64_t& value, const std::string& where) {
    check(json.is_number_unsigned(), where);
    value = json.get<std::uint64_t>();
  }
  static void read(const Record& json, bool& value, const std::string& where) {
    check(json.is_boolean(), where);
    value = json.get<bool>();
  }
  static void read(const Record& json, EffectProof& value, const std::string& where) {
    for (const EffectProof proof : {EffectProof::by_facts, EffectProof::verified, EffectProof::bounded}) {
      if (json == name_of(proof)) {
        value = proof;
        return;
      }
    }
    refuse_record(where + " is no proof");
  }
  static void read(const Record& json, double& value, const std::string& where) {
    check(json.is_number_float(), where);
    value = json.get<double>();
  }
  static void read(const Record& json, std::string& text, const std::string& where) {
    if (json.is_binary()) {
      text.assign(json.get_binary().begin(), json.get_binary().end());
      return;
    }
    check(json.is_string(), where);
    text = json.get_ref<const std::string&>();
  }
  template <class Value>
  static void read(const Record& json, std::optional<Value>& value, const std::string& where) {
    if (!json.is_null()) read(json, value.emplace(), where);
  }
  template <class First, class Second>
  static void read(const Record& json, std::pair<First, Second>& pair, const std::string& where) {
    check(json.is_array() && json.size() == 2, where);
    read(json[0], pair.first, where);
    read(json[1], pair.second, where);
  }
  template <class Value>
  static void read(const Record& json, std::vector<Value>& values, const std::string& where) {
    check(json.is_array(), where);
    values.resize(json.size());
    for (std::size_t i = 0; i < values.size(); ++i) read(json[i], values[i], where);
  }
  template <class Value, std::size_t Size>
  static void read(const Record& json, std::array<Value, Size>& values, const std::string& where) {
    check(json.is_array() && json.size() == Size, where);
    for (std::size_t i = 0; i < Size; ++i) read(json[i], values[i], where);
  }
  template <class Struct>
  static void read(const Record& json, Struct& value, const std::string& where) {
    check(json.is_object(), where);
    std::size_t expected = 0;
    each_member(value, [&](std::string_view of_member, auto& member) {
      if constexpr (!stays<std::decay_t<decltype(member)>>) {
        const std::string name(of_member);
        const auto found = json.find(name);
        if (found == json.end()) refuse_record(where + " has no " + name);
        read(*found, member, where + "." + name);
        ++expected;
      }
    });
    if (json.size() != expected) refuse_record(where + " has more than this version knows");
  }

 private:
  static void check(bool is_right, const std::string& where) {
    if (!is_right) refuse_record(where + " is not what it should be");
  }
};

/// Numbers as they lie in memory, and before what there are several of how many.
class ByteWriter {
 public:
  std::string take() { return std::move(bytes_); }

  void write(std::uint64_t value) { write_as_it_lies(value); }
  void write(double value) { write_as_it_lies(value); }
  void write(bool value) { write_as_it_lies(value); }
  void write(EffectProof proof) { write_as_it_lies(proof); }
  void write(const std::string& text) {
    write(std::uint64_t{text.size()});
    bytes_ += text;
  }
  template <class Value>
  void write(const std::optional<Value>& value) {
    write(value.has_value());
    if (value) write(*value);
  }
  template <class First, class Second>
  void write(const std::pair<First, Second>& pair) {
    write(pair.first);
    write(pair.second);
  }
  template <class Value>
  void write(const std::vector<Value>& values) {
    write(std::uint64_t{values.size()});
    for (const Value& value : values) write(value);
  }
  template <class Value, std::size_t Size>
  void write(const std::array<Value, Size>& values) {
    for (const Value& value : values) write(value);
  }
  template <class Struct>
  std::enable_if_t<std::is_class<Struct>::value> write(const Struct& value) {
    each_member(value, [&](std::string_view, const auto& member) {
      if constexpr (!stays<std::decay_t<decltype(member)>>) write(member);
    });
  }

 private:
  template <class Value>
  void write_as_it_lies(Value value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  std::string bytes_;
};

/// Takes no more memory than the bytes that are there justify.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : left_(bytes) {}
  std::size_t left() const { return left_.size(); }

  void read(std::uint64_t& value) { read_as_it_lies(value); }
  void read(double& value) { read_as_it_lies(value); }
  void read(bool& value) { value = read_up_to(1) != 0; }
  void read(EffectProof& proof) {
    proof = static_cast<EffectProof>(read_up_to(static_cast<std::uint8_t>(EffectProof::bounded)));
  }
  void read(std::string& text) {
    std::uint64_t size = 0;
    read(size);
    text = next(size);
  }
  template <class Value>
  void read(std::optional<Value>& value) {
    bool is_there = false;
    read(is_there);
    if (is_there) read(value.emplace());
  }
  template <class First, class Second>
  void read(std::pair<First, Second>& pair) {
    read(pair.first);
    read(pair.second);
  }
  template <class Value>
  void read(std::vector<Value>& values) {
    std::uint64_t size = 0;
    for (read(size); size > 0; --size) read(values.emplace_back());
  }
  template <class Value, std::size_t Size>
  void read(std::array<Value, Size>& values) {
    for (Value& value : values) read(value);
  }
  template <class Struct>
  std::enable_if_t<std::is_class<Struct>::value> read(Struct& value) {
    each_member(value, [&](std::string_view, auto& member) {
      if constexpr (!stays<std::decay_t<decltype(member)>>) read(member);
    });
  }

 private:
  std::string_view next(std::uint64_t size) {
    if (size > left_.size()) refuse_record("it ends before it should");
    const std::string_view bytes = left_.substr(0, size);
    left_.remove_prefix(size);
    return bytes;
  }
  template <class Value>
  void read_as_it_lies(Value& value) {
    std::memcpy(&value, next(sizeof value).data(), sizeof value);
  }
  std::uint8_t read_up_to(std::uint8_t most) {
    std::uint8_t value = 0;
    read_as_it_lies(value);
    if (value > most) refuse_record("it has a value that there is not");
    return value;
  }

  std::string_view left_;
};

}  // namespace

Record encode(const RunResult& result) { return Writer::of(result); }

RunResult decode(const Record& json, const RunRequest& request) {
  RunResult result;
  Reader::read(json, result, "result");
  result.request = as_taken(request, result.way);
  return result;
}

std::string to_bytes(const RunResult& result) {
  ByteWriter writer;
  writer.write(result);
  return writer.take();
}

RunResult from_bytes(const std::string& bytes, const RunRequest& request) {
  RunResult result;
  ByteReader reader(bytes);
  reader.read(result);
  if (reader.left() != 0) refuse_record("it has more than this version knows");
  result.request = as_taken(request, result.way);
  return result;
}

}  // namespace vrpipe::tools
