#include <vrpipe/component/parameter.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

[[noreturn]] void refuse(const std::string& key, const std::string& text, const std::string& range) {
  const std::string what = "bad value '" + text + "'";
  if (text.find(',') != std::string::npos) {
    throw UserError(what, key, "it is a list, and a parameter takes one value", "give one value: " + range);
  }
  throw UserError(what, key, "it is not " + range, "give " + range);
}

template <class Number>
bool parse(const std::string& text, Number& out) {
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, out);
  return result.ec == std::errc() && result.ptr == end;
}

/// Cuts K, M, G, KiB, MiB or GiB off the end of `text`, and returns its power of 1024; 1 without one.
std::uint64_t take_binary_multiple(std::string& text) {
  std::size_t length = text.size();
  if (length > 2 && text.compare(length - 2, 2, "iB") == 0) length -= 2;
  const std::size_t power = length > 0 ? std::string("KMG").find(text[length - 1]) : std::string::npos;
  if (power == std::string::npos) return 1;
  text.resize(length - 1);
  return std::uint64_t{1024} << (10 * power);
}

}  // namespace

Parameter::Parameter(ParameterSet& owner, const char* name, const char* unit, const char* source, const char* meaning)
    : name_(name), unit_(unit), source_(source), meaning_(meaning) {
  owner.parameters_.push_back(this);
}

void ParameterSet::set(const std::string& unit, const std::string& name, const std::string& value) {
  std::vector<std::string> names;
  for (Parameter* parameter : parameters_) {
    if (name == parameter->name()) {
      parameter->set(value, unit + "." + name);
      return;
    }
    names.emplace_back(parameter->name());
  }
  if (names.empty()) {
    throw UserError("unknown parameter '" + name + "'", "unit " + unit, "the unit has no parameters",
                    "see `vrpipe units`");
  }
  throw UserError("unknown parameter '" + name + "'", "unit " + unit, "the unit does not declare it",
                  suggestion(name, names, "`vrpipe units` lists all", unit + "."));
}

Integer::Integer(ParameterSet& owner, const char* name, std::uint32_t value, std::uint32_t minimum,
                 std::uint32_t maximum, const char* unit, const char* source, const char* meaning)
    : Parameter(owner, name, unit, source, meaning),
      value_(value),
      default_(value),
      minimum_(minimum),
      maximum_(maximum) {}

void Integer::operator=(std::uint32_t value) { set(std::to_string(value), name()); }
std::string Integer::value() const { return std::to_string(value_); }
std::string Integer::default_value() const { return std::to_string(default_); }
std::string Integer::range() const { return fmt::format("a whole number from {} to {}", minimum_, maximum_); }

void Integer::set(const std::string& text, const std::string& key) {
  std::string digits = text;
  const bool is_size = std::string_view(unit()) == "bytes";
  const std::uint64_t multiple = is_size ? take_binary_multiple(digits) : 1;
  std::uint32_t count = 0;
  const bool is_number = parse(digits, count);
  const std::uint64_t value = count * multiple;
  if (!is_number || value < minimum_ || value > maximum_) {
    refuse(key, text, range() + (is_size ? ", where K, M and G are powers of 1024" : ""));
  }
  value_ = static_cast<std::uint32_t>(value);
}

Real::Real(ParameterSet& owner, const char* name, double value, double minimum, double maximum, const char* unit,
           const char* source, const char* meaning)
    : Parameter(owner, name, unit, source, meaning),
      value_(value),
      default_(value),
      minimum_(minimum),
      maximum_(maximum) {}

std::string Real::value() const { return fmt::format("{}", value_); }
std::string Real::default_value() const { return fmt::format("{}", default_); }
std::string Real::range() const { return fmt::format("a number from {} to {}", minimum_, maximum_); }

void Real::set(const std::string& text, const std::string& key) {
  double value = 0;
  if (!parse(text, value) || !(value >= minimum_ && value <= maximum_)) refuse(key, text, range());
  value_ = value;
}

Switch::Switch(ParameterSet& owner, const char* name, bool value, const char* source, const char* meaning)
    : Parameter(owner, name, "", source, meaning), value_(value), default_(value) {}

std::string Switch::value() const { return value_ ? "on" : "off"; }
std::string Switch::default_value() const { return default_ ? "on" : "off"; }
std::string Switch::range() const { return "on or off"; }

void Switch::set(const std::string& text, const std::string& key) {
  if (text != "on" && text != "off") refuse(key, text, range());
  value_ = text == "on";
}

Choice::Choice(ParameterSet& owner, const char* name, std::vector<std::string> names, unsigned value,
               const char* source, const char* meaning)
    : Parameter(owner, name, "", source, meaning), names_(std::move(names)), value_(value), default_(value) {}

std::string Choice::value() const { return names_[value_]; }
std::string Choice::default_value() const { return names_[default_]; }
std::string Choice::range() const { return fmt::format("one of {}", fmt::join(names_, ", ")); }

void Choice::set(const std::string& text, const std::string& key) {
  for (unsigned index = 0; index < names_.size(); ++index) {
    if (names_[index] == text) {
      value_ = index;
      return;
    }
  }
  refuse(key, text, range());
}

}  // namespace vrpipe
