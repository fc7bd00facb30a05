#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vrpipe::tools {

/// The texts given for one option, in the order of the command line; empty when it was not given.
using Values = std::vector<std::string>;

// Headings in help that several commands have.
constexpr const char* scene_group = "What is drawn";
constexpr const char* machine_group = "On which GPU";
constexpr const char* rules_group = "How exactly";
constexpr const char* result_group = "Where results go";
constexpr const char* listed_group = "What is listed";
constexpr const char* other_group = "Options";  ///< also that of --help

/// What a command takes, and what it is given of it.
struct Option {
  enum class Kind {
    text,       ///< a name with a text after it
    flag,       ///< a name alone
    positional  ///< a text alone, known by its place
  };

  Kind kind;
  std::string name;        ///< "--size"; of a positional one as help calls it, "FILE"
  std::string value_name;  ///< how help calls the text: "WxH"
  std::string help;
  std::string group;                         ///< its heading in help; empty: not in help
  std::function<void(const Values&)> store;  ///< told what is given, all of it, whenever that changes; may be empty
  bool is_required = false;
  std::string default_text = {};    ///< what stands for it where it is not given, for --print-config; empty: none
  std::string default_unless = {};  ///< an option beside which nothing does
  /// Throws UserError for a text that is no value whatever else is given; may be empty.
  std::function<void(const std::string&)> check = {};
  Values texts = {};  ///< as given; of a flag "true", as often as it is there

  bool is_given() const { return !texts.empty(); }
  /// These texts are given, and no others.
  void give(Values given);
};

/// All that a command takes, in the order of its help.
class Arguments {
 public:
  /// @param command  its name
  /// @param summary  one line, for `vrpipe --help`
  Arguments(std::string command, std::string summary);

  const std::string& command() const { return command_; }
  const std::string& summary() const { return summary_; }
  const std::string& footer() const { return footer_; }
  /// What stands below the options in the command's help: what it does, and examples.
  void set_footer(std::string text) { footer_ = std::move(text); }

  // The texts go into the variable of the command, which must live as long. Options stay where they are in memory.

  Option& add(Option option);
  /// An option that takes one text each time that it is given; single() refuses a second.
  Option& add_option(const std::string& name, Values& texts, const std::string& value_name, const std::string& help,
                     const std::string& group);
  Option& add_flag(const std::string& name, bool& is_given, const std::string& help, const std::string& group);
  /// May be left out, which leaves the text empty, unless `is_required` is set.
  Option& add_positional(const std::string& name, std::string& text, const std::string& help);

  std::deque<Option>& options() { return options_; }
  const std::deque<Option>& options() const { return options_; }
  /// Null if there is none.
  Option* find(const std::string& name);
  const Option* find(const std::string& name) const;

 private:
  std::string command_, summary_, footer_;
  std::deque<Option> options_;
};

/// The text of an option that may be given once; none when it was not. Throws UserError.
std::optional<std::string> single(const Values& values, const std::string& option);

/// The same of an option that names a file or folder.
std::optional<std::filesystem::path> single_path(const Values& values, const std::string& option);

/// Reads the command line of vrpipe, and gives the options of the command that it calls their texts. Throws UserError for
/// what is no such command line.
/// @param description, footer  around the list of commands in `vrpipe --help`
/// @return which of the commands is called; none if there is nothing more to do: help or the version is printed
std::optional<std::size_t> parse_command_line(int argc, const char* const* argv, const char* description,
                                              const char* footer, std::vector<Arguments>& commands);

}  // namespace vrpipe::tools
