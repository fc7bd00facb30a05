#include "cli/config_file.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/component/error.h>

#include "cli/options.h"
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
  ConfigReader(const std::filesystem::path& path, const CLI::App& app)
      : TomlFile(path, "cannot read configuration", std::string(config_option) + " " + path.string(),
                 "docs/configuration.md"),
        app_(app) {}

  [[noreturn]] void refuse_key(const toml::node& node, const std::string& key,
                               const std::vector<std::string>& known) const {
    refuse(node, "unknown key '" + key + "'", "there is no such key here",
           fmt::format("did you mean {}? `vrpipe {} --help` lists the options", nearest_name(key, known),
                       app_.get_name()));
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
  std::string value(const toml::node& node, const std::string& key, const CLI::Option& option) const {
    return with_file_of(option, scalar(node, key),
                        [&](const std::filesystem::path& file) { return in_folder(path().parent_path(), file); });
  }

 private:
  const CLI::App& app_;
};

std::string key_of(const std::string& text) { return text.substr(0, text.find('=')); }

/// Options whose values are merged key by key; of others those of the command line take the place of the file's.
bool is_merged(const std::string& option) {
  return option == "--set" || option == "--unit" || option == "--define" || option == "--plugin";
}

}  // namespace

std::string with_file_of(const CLI::Option& option, const std::string& text,
                         const std::function<std::filesystem::path(const std::filesystem::path&)>& change) {
  const std::string type = option.get_type_name();
  if (type.find("FILE") == std::string::npos && type.find("DIR") == std::string::npos) return text;
  return with_file(text, type.find("NAME=FILE") != std::string::npos, change);
}

ConfigFile::ConfigFile(const std::filesystem::path& path, CLI::App& app, const std::vector<std::string>& others)
    : path_(path) {
  read(app, others);
  apply(app);
}

void ConfigFile::read(CLI::App& app, const std::vector<std::string>& others) {
  const ConfigReader reader(path_, app);
  std::vector<std::string> known{settings_key, units_key};
  const CLI::Option* const define = app.get_option_no_throw("--define");
  if (define != nullptr) known.push_back(variants_key);
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      const std::array<const char*, 6> special{"help", "config", "print-config", "set", "unit", "define"};
      if (std::find(special.begin(), special.end(), name) == special.end()) known.push_back(name);
    }
  }
  known.insert(known.end(), others.begin(), others.end());
  for (const auto& [key, node] : ConfigReader::in_order(reader.root())) {
    if (std::find(others.begin(), others.end(), key) != others.end()) continue;
    const unsigned line = ConfigReader::position(*node).line;
    const CLI::Option* const option = app.get_option_no_throw("--" + key);
    if (std::find(known.begin(), known.end(), key) == known.end()) reader.refuse_key(*node, key, known);
    if (key == settings_key || key == units_key) {
      if (option == nullptr) reader.refuse_key(*node, key, known);
      for (const auto& [path, leaf] : TomlFile::leaves(reader.table(*node, key))) {
        const std::string value = reader.scalar(*leaf, path);
        add("--" + key, path, path + "=" + value, leaf->source().begin.line);
        mention(path, value, leaf->source().begin.line);
      }
    } else if (key == variants_key) {
      for (const auto& [name, each] : ConfigReader::in_order(reader.table(*node, key))) {
        const VariantDefinition definition = reader.variant(name, *each);
        add("--define", name, text_of(definition), ConfigReader::position(*each).line);
        for (const auto& [path, leaf] : TomlFile::leaves(*each->as_table())) {
          const std::size_t dot = path.find('.');
          if (dot != std::string::npos)
            mention(path.substr(dot + 1), reader.scalar(*leaf, path), leaf->source().begin.line);
        }
      }
    } else if (option->get_expected_max() == 0) {
      const auto* flag = node->as_boolean();
      if (flag == nullptr) reader.refuse(*node, "bad value of '" + key + "'", "it is a switch", "give true or false");
      if (flag->get()) add("--" + key, "", "true", line);
    } else {
      const std::string type = option->get_type_name();
      const toml::array* const list = node->as_array();
      // Of several numbers, as X,Y,Z, or several values of an option that can be repeated.
      if (list != nullptr && type.find(',') != std::string::npos && type.find('=') == std::string::npos) {
        std::string text;
        for (const toml::node& each : *list) text += (text.empty() ? "" : ",") + reader.scalar(each, key);
        add("--" + key, "", text, line);
      } else if (list != nullptr) {
        for (const toml::node& each : *list) {
          const std::string text = reader.value(each, key, *option);
          add("--" + key, is_merged("--" + key) ? text : "", text, each.source().begin.line);
        }
      } else {
        const std::string text = reader.value(*node, key, *option);
        add("--" + key, is_merged("--" + key) ? text : "", text, line);
      }
    }
  }
}

void ConfigFile::apply(CLI::App& app) {
  std::vector<std::string> options;
  for (const Entry& entry : entries_) {
    if (std::find(options.begin(), options.end(), entry.option) == options.end()) options.push_back(entry.option);
  }
  for (const std::string& name : options) {
    CLI::Option* const option = app.get_option(name);
    const std::vector<std::string> typed = option->results();
    std::vector<std::string> typed_keys;
    for (const std::string& text : typed) typed_keys.push_back(key_of(text));
    if (name == "--define") {
      for (const std::string& text : app.get_option("--variant")->results()) {
        if (text.find('=') != std::string::npos) typed_keys.push_back(key_of(text));
      }
    }
    std::vector<std::string> results;
    for (Entry& entry : entries_) {
      if (entry.option != name) continue;
      entry.used = is_merged(name) ? std::find(typed_keys.begin(), typed_keys.end(), entry.key) == typed_keys.end()
                                   : typed.empty();
      if (entry.used) results.push_back(entry.text);
    }
    if (results.empty()) continue;
    results.insert(results.end(), typed.begin(), typed.end());
    option->clear();
    for (const std::string& text : results) option->add_result(text);
    option->run_callback();
  }
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
  // A definition is complained of as the --variant that it is.
  const std::string what = option == "--define" ? "--variant " + key : entries_.back().what();
  for (const char* end : {")", "=", " ", ","}) mentions_.push_back({"(" + what + end, line});
}

void ConfigFile::mention(const std::string& key, const std::string& value, unsigned line) {
  mentions_.push_back({"(" + key + ")", line});
  mentions_.push_back({fmt::format("'{}' (slot {})", value, key), line});
  const std::size_t dot = key.rfind('.');
  if (dot != std::string::npos)
    mentions_.push_back({fmt::format("'{}' (unit {})", key.substr(dot + 1), key.substr(0, dot)), line});
}

std::string ConfigFile::located(std::string message) const {
  // The longest says the most.
  const Mention* best = nullptr;
  for (const Mention& each : mentions_) {
    if (message.find(each.text) == std::string::npos) continue;
    if (best == nullptr || each.text.size() > best->text.size()) best = &each;
  }
  if (best == nullptr) return message;
  const std::size_t place = message.find(best->text) + best->text.find('(') + 1;
  return message.insert(place, fmt::format("{}:{}, ", path_.string(), best->line));
}

void note_config(const Invocation& invocation, Provenance& provenance) {
  if (!invocation.config) return;
  provenance.config = invocation.config->path().string();
  provenance.config_settings = invocation.config->settings();
}

void declare_config(CLI::App& app) {
  const std::string group = "A configuration";
  app.add_option(config_option)
      ->type_name("FILE.toml")
      ->description(
          "what is not on the command line is as this file says, which says all that the\n"
          "command line can, and defines variants (docs/configuration.md)")
      ->allow_extra_args(false)
      ->expected(1)
      ->take_all()
      ->group(group);
  app.add_flag(print_option)
      ->description(
          "prints such a file of all that the command would do, with every parameter\n"
          "and where its value comes from, and does nothing")
      ->disable_flag_override()
      ->group(group);
}

std::optional<ConfigFile> read_config(CLI::App& app) {
  const CLI::Option* const option = app.get_option_no_throw(config_option);
  if (option == nullptr) return std::nullopt;
  const auto file = single(option->results(), config_option);
  if (!file) return std::nullopt;
  return std::optional<ConfigFile>(std::in_place, *file, app);
}

}  // namespace vrpipe::tools
