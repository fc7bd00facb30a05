#include "cli/config_file.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "host/command_failure.h"
#include "jobs/toml_file.h"
#include "jobs/user_variants.h"

namespace vrpipe::tools {
namespace {

constexpr const char* config_option = "--config";
constexpr const char* print_option = "--print-config";
const std::string settings_key = "set";
const std::string units_key = "unit";
const std::string variants_key = "variants";

/// Of the file, with what the readers of its parts need.
class ConfigReader : public TomlFile {
 public:
  /// Of a command without --config the file is a study.
  ConfigReader(const std::filesystem::path& path, const Arguments& arguments)
      : ConfigReader(path, arguments, arguments.find(config_option) == nullptr) {}

  [[noreturn]] void refuse_key(const toml::node& node, const std::string& key,
                               const std::vector<std::string>& known) const {
    refuse(node, "unknown key '" + key + "'", "there is no such key here",
           suggestion(key, known, fmt::format("`vrpipe {} --help` lists the options", arguments_.command())));
  }

  /// Of tables, lists of tables and lists of values, by dotted paths; not of what is neither text, number nor switch.
  template <class See>
  void for_each_value(const toml::node& node, const See& see, const std::string& name = "") const {
    if (const toml::table* const table = node.as_table()) {
      if (const toml::node* const from = table->get("from")) return see(name, *from);
      for (const auto& [path, leaf] : leaves(*table, "from")) for_each_value(*leaf, see, path);
    } else if (const toml::array* const list = node.as_array()) {
      for (const toml::node& each : *list) for_each_value(each, see, name);
    } else if (!name.empty() && (node.is_string() || node.is_number() || node.is_boolean())) {
      see(name, node);
    }
  }

  const toml::table& table(const toml::node& node, const std::string& key) const {
    if (const toml::table* found = node.as_table()) return *found;
    refuse(node, "bad value of '" + key + "'", "it is no table", "write [" + key + "], and its keys below");
  }

  VariantDefinition variant(const std::string& name, const toml::node& node) const {
    VariantDefinition definition{name, "", {}};
    for (const auto& [key, value] : in_order(table(node, variants_key + "." + name))) {
      if (key == "base") {
        definition.base = scalar(*value, key);
      } else if (key == settings_key || key == units_key) {
        for (const auto& [path, leaf] : leaves(table(*value, key))) {
          definition.changes.emplace_back(path, scalar(*leaf, path));
        }
      } else {
        refuse_key(*value, key, {"base", settings_key, units_key});
      }
    }
    if (definition.base.empty()) {
      refuse(node, "incomplete variant '" + name + "'", "it has no base", "add e.g. base = \"het+qm\"");
    }
    return definition;
  }

  /// A value of an option, with names of files from where vrpipe runs.
  std::string value(const toml::node& node, const std::string& key, const Option& option) const {
    return with_file_of(option, scalar(node, key),
                        [&](const std::filesystem::path& file) { return in_folder(path().parent_path(), file); });
  }

 private:
  ConfigReader(const std::filesystem::path& path, const Arguments& arguments, bool is_study)
      : TomlFile(path, is_study ? "cannot read study" : "cannot read configuration",
                 is_study ? path.string() : std::string(config_option) + " " + path.string(),
                 is_study ? "docs/studies.md" : "docs/configuration.md"),
        arguments_(arguments) {}

  const Arguments& arguments_;
};

/// As help calls its value.
bool names_file(const Option& option) {
  const std::string& type = option.value_name;
  return type.find("FILE") != std::string::npos || type.find("DIR") != std::string::npos;
}

std::string key_of(const std::string& text) { return text.substr(0, text.find('=')); }

/// Options whose values are merged key by key; of others those of the command line take the place of the file's.
bool is_merged(const std::string& option) {
  return option == "--set" || option == "--unit" || option == "--define" || option == "--plugin";
}

}  // namespace

std::string with_file_of(const Option& option, const std::string& text,
                         const std::function<std::filesystem::path(const std::filesystem::path&)>& change) {
  if (!names_file(option)) return text;
  return with_file(text, option.value_name.find("NAME=FILE") != std::string::npos, change);
}

ConfigFile::ConfigFile(const std::filesystem::path& path, Arguments& arguments, const std::vector<std::string>& others)
    : path_(path) {
  read(arguments, others);
  apply(arguments);
}

void ConfigFile::read(Arguments& arguments, const std::vector<std::string>& others) {
  const ConfigReader reader(path_, arguments);
  std::vector<std::string> known{settings_key, units_key};
  if (arguments.find("--define") != nullptr) known.push_back(variants_key);
  for (const Option& option : arguments.options()) {
    const std::array<const char*, 5> special{config_option, print_option, "--set", "--unit", "--define"};
    if (option.kind == Option::Kind::positional) continue;
    if (std::find(special.begin(), special.end(), option.name) == special.end()) known.push_back(option.name.substr(2));
  }
  known.insert(known.end(), others.begin(), others.end());
  const auto mention_node = [&](const std::string& entry, const std::string& key, const toml::node& node) {
    const std::string value = reader.scalar(node, key);
    const auto flag = node.value_exact<bool>();
    mention(entry, key, value, flag ? (*flag ? "true" : "false") : value, node.source().begin.line);
  };
  for (const auto& [key, node] : ConfigReader::in_order(reader.root())) {
    if (std::find(others.begin(), others.end(), key) != others.end()) {
      reader.for_each_value(*node, [&](const std::string& name, const toml::node& value) {
        for (const std::string& called : {name, "axis " + name, "--" + name}) mention_node("", called, value);
        if (name == "scene")
          mention_file("", reader.value(value, name, *arguments.find("--scene")), value.source().begin.line);
      });
      continue;
    }
    const unsigned line = ConfigReader::position(*node).line;
    const Option* const option = arguments.find("--" + key);
    if (std::find(known.begin(), known.end(), key) == known.end()) reader.refuse_key(*node, key, known);
    if (key == settings_key || key == units_key) {
      if (option == nullptr) reader.refuse_key(*node, key, known);
      for (const auto& [path, leaf] : TomlFile::leaves(reader.table(*node, key))) {
        if (key == settings_key && path.find('.') == std::string::npos) {
          reader.refuse(*leaf, "unknown key '" + path + "' of [set]", "it is no UNIT.PARAMETER",
                        "write e.g. tc.bins = 64; `vrpipe units` lists all");
        }
        add("--" + key, path, path + "=" + reader.scalar(*leaf, path), leaf->source().begin.line);
        mention_node("--" + key + " " + path, path, *leaf);
      }
    } else if (key == variants_key) {
      for (const auto& [name, each] : ConfigReader::in_order(reader.table(*node, key))) {
        const VariantDefinition definition = reader.variant(name, *each);
        add("--define", name, text_of(definition), ConfigReader::position(*each).line);
        for (const auto& [path, leaf] : TomlFile::leaves(*each->as_table())) {
          const std::size_t dot = path.find('.');
          if (dot != std::string::npos) mention_node("--define " + name, path.substr(dot + 1), *leaf);
        }
      }
    } else if (option->kind == Option::Kind::flag) {
      const auto* flag = node->as_boolean();
      if (flag == nullptr) reader.refuse(*node, "bad value of '" + key + "'", "it is a switch", "give true or false");
      if (flag->get()) add("--" + key, "", "true", line);
    } else {
      const std::string& type = option->value_name;
      const toml::array* const list = node->as_array();
      const auto add_value = [&, &name = key](const toml::node& value, unsigned at) {
        const std::string text = reader.value(value, name, *option);
        add(option->name, is_merged(option->name) ? text : "", text, at);
        if (names_file(*option)) mention_file(entries_.back().what(), text, at);
      };
      // Of several numbers, as X,Y,Z, or several values of an option that can be repeated.
      if (list != nullptr && type.find(',') != std::string::npos && type.find('=') == std::string::npos) {
        std::string text;
        for (const toml::node& each : *list) text += (text.empty() ? "" : ",") + reader.scalar(each, key);
        add("--" + key, "", text, line);
      } else if (list != nullptr) {
        for (const toml::node& each : *list) add_value(each, each.source().begin.line);
      } else {
        add_value(*node, line);
      }
    }
  }
}

void ConfigFile::apply(Arguments& arguments) {
  std::vector<std::string> options;
  for (const Entry& entry : entries_) {
    if (std::find(options.begin(), options.end(), entry.option) == options.end()) options.push_back(entry.option);
  }
  for (const std::string& name : options) {
    Option* const option = arguments.find(name);
    const Values typed = option->texts;
    std::vector<std::string> typed_keys;
    for (const std::string& text : typed) typed_keys.push_back(key_of(text));
    if (name == "--define") {
      const Option* const variant = arguments.find("--variant");
      for (const std::string& text : variant == nullptr ? Values() : variant->texts) {
        if (text.find('=') != std::string::npos) typed_keys.push_back(key_of(text));
      }
    }
    Values texts;
    for (Entry& entry : entries_) {
      if (entry.option != name) continue;
      entry.used = is_merged(name) ? std::find(typed_keys.begin(), typed_keys.end(), entry.key) == typed_keys.end()
                                   : typed.empty();
      if (entry.used) texts.push_back(entry.text);
    }
    if (texts.empty()) continue;
    texts.insert(texts.end(), typed.begin(), typed.end());
    option->give(texts);
  }
  // What the file does not give is complained of as the command line's.
  mentions_.erase(std::remove_if(mentions_.begin(), mentions_.end(),
                                 [&](const Mention& each) {
                                   return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
                                     return !entry.used && entry.what() == each.entry;
                                   });
                                 }),
                  mentions_.end());
}

bool ConfigFile::gives(const std::string& what) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.used && (entry.what() == what || entry.option == what); });
}

std::vector<std::string> ConfigFile::settings() const {
  std::vector<std::string> keys;
  for (const Entry& entry : entries_) {
    if (entry.used && entry.option == "--set") keys.push_back(entry.key);
  }
  return keys;
}

void ConfigFile::add(const std::string& option, const std::string& key, const std::string& text, unsigned line) {
  entries_.push_back({option, key, text, line});
  const std::string entry = entries_.back().what();
  // A definition is complained of as the --variant that it is.
  const std::string what = option == "--define" ? "--variant " + key : entry;
  for (const char* end : {")", "=", " ", ","}) mentions_.push_back({entry, "(" + what + end, line, {}});
}

void ConfigFile::mention(const std::string& entry, const std::string& key, const std::string& value,
                         const std::string& as_written, unsigned line) {
  for (const char* end : {")", ","}) mentions_.push_back({entry, "(" + key + end, line, {}});
  mentions_.push_back({entry, fmt::format("'{}' (slot {})", value, key), line, {}});
  mentions_.push_back({entry, fmt::format("'{}' ({}", value, key), line, fmt::format("'{}' (", as_written)});
  const std::size_t dot = key.rfind('.');
  if (dot != std::string::npos)
    mentions_.push_back({entry, fmt::format("'{}' (unit {}", key.substr(dot + 1), key.substr(0, dot)), line, {}});
}

void ConfigFile::mention_file(const std::string& entry, const std::string& text, unsigned line) {
  for (const std::string& file : {text, text.substr(text.find('=') + 1)}) {
    for (const char* end : {")", ","}) mentions_.push_back({entry, "(" + file + end, line, {}});
  }
}

void ConfigFile::check_overridden(const Arguments& arguments) const {
  for (const Entry& entry : entries_) {
    const Option& option = *arguments.find(entry.option);
    if (entry.used || !option.check) continue;
    try {
      option.check(entry.text);
    } catch (const UserError& error) {
      std::string message = error.what();
      throw CommandFailure(exit_user_error, message.insert(message.find(" (") + 2, place(entry.line) + ", "));
    }
  }
}

std::string ConfigFile::place(unsigned line) const { return fmt::format("{}:{}", path_.string(), line); }

std::string ConfigFile::located(std::string message) const {
  // The longest says the most.
  const Mention* best = nullptr;
  for (const Mention& each : mentions_) {
    if (message.find(each.text) == std::string::npos) continue;
    if (best == nullptr || each.text.size() > best->text.size()) best = &each;
  }
  if (best == nullptr) return message;
  const std::size_t start = message.find(best->text), size = best->text.find('(') + 1;
  const std::string before = best->as_written.empty() ? best->text.substr(0, size) : best->as_written;
  return message.replace(start, size, before + place(best->line) + ", ");
}

void note_config(const Invocation& invocation, Provenance& provenance) {
  if (!invocation.config) return;
  provenance.config = invocation.config->path().string();
  provenance.config_settings = invocation.config->settings();
}

void declare_config(Arguments& arguments) {
  const char* const group = "A configuration";
  arguments.add({Option::Kind::text, config_option, "FILE.toml",
                 "what is not on the command line is as this file says, which says all that the\n"
                 "command line can, and defines variants (docs/configuration.md)",
                 group, nullptr});
  arguments.add({Option::Kind::flag, print_option, "",
                 "prints such a file of all that the command would do, with every parameter\n"
                 "and where its value comes from, and does nothing",
                 group, nullptr});
}

std::optional<ConfigFile> read_config(Arguments& arguments) {
  const Option* const option = arguments.find(config_option);
  if (option == nullptr) return std::nullopt;
  const auto file = single(option->texts, config_option);
  if (!file) return std::nullopt;
  return std::optional<ConfigFile>(std::in_place, *file, arguments);
}

}  // namespace vrpipe::tools
