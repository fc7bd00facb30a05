#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vrpipe {

class ParameterSet;

/// One declared parameter: everything that the command line, the checks, `vrpipe units`, the JSON and the reference
/// documentation say about it comes from here.
class Parameter {
 public:
  Parameter(ParameterSet& owner, const char* name, const char* unit, const char* source, const char* meaning);
  virtual ~Parameter() = default;
  Parameter(const Parameter&) = delete;
  Parameter& operator=(const Parameter&) = delete;

  const char* name() const { return name_; }
  const char* unit() const { return unit_; }        ///< of the value, e.g. "cycles"; "" for a choice or a switch
  const char* source() const { return source_; }    ///< where the default comes from
  const char* meaning() const { return meaning_; }  ///< one line
  virtual std::string value() const = 0;
  virtual std::string default_value() const = 0;
  virtual std::string range() const = 0;  ///< the allowed values, in words
  /// Throws UserError when the text is not an allowed value; `key` is UNIT.PARAMETER for the message.
  virtual void set(const std::string& text, const std::string& key) = 0;

 private:
  const char* name_;
  const char* unit_;
  const char* source_;
  const char* meaning_;
};

/// The parameters of one unit. A unit derives from it and declares each parameter as a member, in one line.
class ParameterSet {
 public:
  ParameterSet() = default;
  virtual ~ParameterSet() = default;
  ParameterSet(const ParameterSet&) = delete;
  ParameterSet& operator=(const ParameterSet&) = delete;

  const std::vector<Parameter*>& parameters() const { return parameters_; }
  /// Throws UserError for an unknown name (naming the nearest) or a value out of range.
  void set(const std::string& unit, const std::string& name, const std::string& value);

 private:
  friend class Parameter;
  std::vector<Parameter*> parameters_;
};

/// A whole number in [minimum, maximum].
class Integer : public Parameter {
 public:
  Integer(ParameterSet& owner, const char* name, std::uint32_t value, std::uint32_t minimum, std::uint32_t maximum,
          const char* unit, const char* source, const char* meaning);
  operator std::uint32_t() const { return value_; }
  void operator=(std::uint32_t value);
  std::string value() const override;
  std::string default_value() const override;
  std::string range() const override;
  void set(const std::string& text, const std::string& key) override;

 private:
  std::uint32_t value_;
  std::uint32_t default_;
  std::uint32_t minimum_;
  std::uint32_t maximum_;
};

/// A finite real number in [minimum, maximum].
class Real : public Parameter {
 public:
  Real(ParameterSet& owner, const char* name, double value, double minimum, double maximum, const char* unit,
       const char* source, const char* meaning);
  operator double() const { return value_; }
  /// For integer time: rounded to thousandths.
  std::uint32_t thousandths() const { return static_cast<std::uint32_t>(value_ * 1000 + 0.5); }
  std::string value() const override;
  std::string default_value() const override;
  std::string range() const override;
  void set(const std::string& text, const std::string& key) override;

 private:
  double value_;
  double default_;
  double minimum_;
  double maximum_;
};

/// On or off.
class Switch : public Parameter {
 public:
  Switch(ParameterSet& owner, const char* name, bool value, const char* source, const char* meaning);
  operator bool() const { return value_; }
  std::string value() const override;
  std::string default_value() const override;
  std::string range() const override;
  void set(const std::string& text, const std::string& key) override;

 private:
  bool value_;
  bool default_;
};

/// One of several names; converts to the index of the chosen one.
class Choice : public Parameter {
 public:
  Choice(ParameterSet& owner, const char* name, std::vector<std::string> names, unsigned value, const char* source,
         const char* meaning);
  operator unsigned() const { return value_; }
  std::string value() const override;
  std::string default_value() const override;
  std::string range() const override;
  void set(const std::string& text, const std::string& key) override;

 private:
  std::vector<std::string> names_;
  unsigned value_;
  unsigned default_;
};

/// Where defaults come from, in the words that the documentation prints.
namespace source {
constexpr const char* paper_table = "VR-Pipe, simulation configuration table";
constexpr const char* paper_text = "VR-Pipe, text";
constexpr const char* measured = "measured on a GH100 graphics GPC";
constexpr const char* open = "left open by the paper; see docs/open-parameters.md";
}  // namespace source

}  // namespace vrpipe
