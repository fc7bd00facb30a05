#include <vrpipe/parameter.h>

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include <vrpipe/error.h>

namespace vrpipe {

namespace {

[[noreturn]] void refuse(const std::string& key, const std::string& text, const std::string& range) {
  throw UserError("bad value '" + text + "'", key, "it is not " + range, "give " + range);
}

template <class Number>
bool parse(const std::string& text, Number& out) {
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, out);
  return result.ec == std::errc() && result.ptr == end;
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
                  "did you mean " + unit + "." + nearest_name(name, names) + "? `vrpipe units` lists all");
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
  std::uint32_t value = 0;
  if (!parse(text, value) || value < minimum_ || value > maximum_) refuse(key, text, range());
  value_ = value;
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
