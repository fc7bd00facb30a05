#include "cli/print_config.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/netlist.h>

#include "jobs/settings.h"

namespace vrpipe::tools {
namespace {

constexpr std::size_t comment_column = 44;

std::string toml_quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += std::string("\\") + c;
    } else if (code < 0x20 || code == 0x7f) {
      result += fmt::format("\\u{:04X}", code);
    } else {
      result += c;
    }
  }
  return result + "\"";
}

/// A key, bare where TOML lets it be: dots stay dots.
std::string key_text(const std::string& key) {
  const auto is_bare = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.'; };
  return std::all_of(key.begin(), key.end(), is_bare) ? key : toml_quoted(key);
}

/// A number, or true and false, where it reads back as this very text.
std::string value_text(const std::string& text) {
  if (text == "on") return "true";
  if (text == "off") return "false";
  const char* const end = text.data() + text.size();
  std::int64_t whole = 0;
  if (const auto read = std::from_chars(text.data(), end, whole);
      read.ec == std::errc() && read.ptr == end && std::to_string(whole) == text) {
    return text;
  }
  double number = 0;
  if (const auto read = std::from_chars(text.data(), end, number);
      read.ec == std::errc() && read.ptr == end && std::isfinite(number) && fmt::format("{}", number) == text &&
      text.find('.') != std::string::npos) {
    return text;
  }
  return toml_quoted(text);
}

std::string line_of(const std::string& key, const std::string& value, const std::string& comment) {
  const std::string line = key + " = " + value;
  return fmt::format("{:<{}} # {}\n", line, comment_column, comment);
}

/// Independent of where the file will stand.
std::filesystem::path from_the_root(const std::filesystem::path& file) {
  return std::filesystem::absolute(file).lexically_normal();
}

/// What help says of an option that is not given.
std::string default_of(const Option& option) {
  const std::string start = "(default: ";
  std::string text = option.help;
  const std::size_t begin = text.find(start);
  if (begin == std::string::npos) return "not given";
  std::size_t end = begin;
  for (int depth = 0; end < text.size(); ++end) {
    depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
    if (depth == 0) break;
  }
  text = text.substr(begin + start.size(), end - begin - start.size());
  std::replace(text.begin(), text.end(), '\n', ' ');
  return "default: " + text;
}

/// Of a parameter of one unit or link: what it is called in all GPCs.
std::string kind_of(const std::string& parameter) {
  const std::string link = "link.";
  const std::size_t begin = parameter.compare(0, link.size(), link) == 0 ? link.size() : 0, end = parameter.rfind('.');
  return parameter.substr(0, begin) + without_gpc(parameter.substr(begin, end - begin)) + parameter.substr(end);
}

class ConfigWriter {
 public:
  ConfigWriter(const Invocation& invocation, const std::vector<RunRequest>& requests,
               const std::map<std::string, std::string>& camera)
      : invocation_(invocation), requests_(requests), camera_(camera) {}

  std::string options() const {
    std::string text;
    for (const Option& option : invocation_.arguments->options()) {
      if (option.group.empty() || option.kind == Option::Kind::positional) continue;
      const std::string name = option.name.substr(2);
      if (name == "config" || name == "print-config" || name == "set" || name == "unit") continue;
      text += option_line(option, name);
    }
    return text;
  }

  std::string units() const {
    std::string text;
    for (const UnitChoice& unit : requests_.front().units) {
      text += line_of(key_text(unit.slot), toml_quoted(unit.implementation), given("--unit", unit.slot));
    }
    return text.empty() ? text : "\n[unit]\n" + text;
  }

  std::string variants() const {
    std::string text;
    std::vector<std::string> seen;
    for (const Variant& variant : vrpipe::variants()) {
      if (variant.base.empty()) continue;
      text += fmt::format("\n[variants.{}]\n", key_text(variant.name));
      text += line_of("base", toml_quoted(variant.base), given("--define", variant.name));
      // What it changes of a base that is such a variant as well is there twice, which changes nothing.
      for (const UnitChoice& unit : variant.changed_units)
        text += fmt::format("unit.{} = {}\n", key_text(unit.slot), toml_quoted(unit.implementation));
      for (const Setting& setting : variant.changed_settings) {
        text +=
            fmt::format("set.{} = {}\n", key_text(setting.unit + "." + setting.parameter), value_text(setting.value));
      }
    }
    return text;
  }

  using Parameters = std::vector<std::pair<std::string, std::string>>;
  std::string parameters(const Parameters& preprocess) const {
    std::string text = "\n[set]\n";
    for (const auto& [name, value] : preprocess) text += parameter_line(name, value, nullptr);
    // What variants set stands in their tables.
    std::vector<RunRequest> runs;
    std::vector<Parameters> all;
    std::vector<std::map<std::string, Parameters>> of_kind;  // the units', with those of instances that differ
    for (const RunRequest& request : requests_) {
      runs.push_back(without_changes(request));
      all.push_back(final_parameters(runs.back()));
      of_kind.emplace_back();
      for (const auto& parameter : all.back()) of_kind.back()[kind_of(parameter.first)].push_back(parameter);
    }
    // Platforms, and units that variants bring, differ in what they have and in their defaults.
    const auto is_common = [&](const std::string& name) {
      const std::string kind = kind_of(name);
      return std::all_of(of_kind.begin(), of_kind.end(), [&](const auto& of_run) {
        const auto found = of_run.find(kind);
        return found != of_run.end() && found->second == of_kind.front().at(kind);
      });
    };
    for (const auto& [name, value] : all.front()) {
      if (is_common(name)) text += parameter_line(name, value, &runs.front());
    }
    for (const Setting& setting : requests_.front().settings) {
      const std::string name = setting.unit + "." + setting.parameter;
      if (!is_common(name)) text += parameter_line(name, setting.value, nullptr);
    }
    std::set<std::string> seen;
    for (std::size_t i = 0; i < all.size(); ++i) {
      std::string own;
      for (const auto& [name, value] : all[i]) {
        if (!is_common(name)) own += "# " + parameter_line(name, value, &runs[i]);
      }
      if (own.empty() || !seen.insert(own).second) continue;
      text += "\n# " + name_of(runs[i]) + " has these, of its own\n" + own;
    }
    return text;
  }

 private:
  std::string given(const std::string& option, const std::string& key = "") const {
    return invocation_.gives(key.empty() ? option : option + " " + key) ? invocation_.config->path().string()
                                                                        : std::string("command line");
  }

  std::string option_line(const Option& option, const std::string& name) const {
    const bool has_default = !option.default_text.empty() && !is_given(option.default_unless);
    if (const auto of_scene = camera_.find(name); !option.is_given() && of_scene != camera_.end())
      return line_of(name, value_text(of_scene->second), "scene");
    if (!option.is_given() && !has_default) {
      return fmt::format("{:<{}} # {}\n", "# " + name, comment_column, default_of(option));
    }
    // Some commands' default platform goes by what they are to do.
    const std::string& default_text = name == "platform" ? requests_.front().platform->name : option.default_text;
    if (!option.is_given()) return line_of(name, value_text(default_text), "default");
    if (option.kind == Option::Kind::flag) return line_of(name, "true", given(option.name));
    std::vector<std::string> values;
    for (const std::string& text : option.texts) {
      // A variant that is defined where it is chosen stands below.
      const bool defines = name == "variant" && text.find('=') != std::string::npos;
      const std::string value = defines ? text.substr(0, text.find('=')) : with_file_of(option, text, from_the_root);
      values.push_back(option.texts.size() == 1 ? value_text(value) : toml_quoted(value));
    }
    const std::string value = values.size() == 1 ? values.front() : fmt::format("[{}]", fmt::join(values, ", "));
    return line_of(name, value, given(option.name));
  }

  bool is_given(const std::string& option) const {
    const Option* const found = option.empty() ? nullptr : invocation_.arguments->find(option);
    return found != nullptr && found->is_given();
  }

  std::string parameter_line(const std::string& name, const std::string& value, const RunRequest* run) const {
    std::string origin = "default";
    const auto has = [&](const std::vector<Setting>& settings) {
      return std::any_of(settings.begin(), settings.end(), [&](const Setting& setting) {
        const std::string set = setting.unit + "." + setting.parameter;
        return set == name || set == without_gpc(name);
      });
    };
    if (run != nullptr && has(run->platform->settings)) origin = "platform";
    for (const std::string& text : invocation_.arguments->find("--set")->texts) {
      const std::string key = text.substr(0, text.find('='));
      if (key == name || key == without_gpc(name)) origin = given("--set", key);
    }
    if (run != nullptr && has(run->variant.changed_settings)) origin = "variant";
    return line_of(key_text(name), value_text(value), origin);
  }

  const Invocation& invocation_;
  const std::vector<RunRequest>& requests_;
  const std::map<std::string, std::string>& camera_;
};

}  // namespace

std::map<std::string, std::string> camera_texts(const SimulationJob& job) {
  for (const FrameCommand& command : job.frame.commands) {
    if (job.scene.camera || !command.draw || command.draw->is_mesh) continue;
    SceneRequest request = job.scene;
    request.scene = command.draw->scene;
    const std::optional<Viewpoint> viewpoint = viewpoint_of(request);
    if (!viewpoint) continue;
    const View& view = *viewpoint->view;
    const auto triple = [](const Vec3& of) { return fmt::format("{},{},{}", of[0], of[1], of[2]); };
    std::map<std::string, std::string> texts{{"size",
                                              fmt::format("{}x{}", viewpoint->camera.width, viewpoint->camera.height)},
                                             {"eye", triple(view.eye)},
                                             {"look-at", triple(view.look_at)},
                                             {"up", triple(view.up)}};
    if (!view.orthographic_height) texts.emplace("fovy", fmt::format("{}", view.fovy_degrees));
    return texts;
  }
  return {};
}

bool prints_config(const Invocation& invocation) {
  const Option* const option = invocation.arguments->find("--print-config");
  return option != nullptr && option->is_given();
}

std::string config_text(const Invocation& invocation, const std::vector<RunRequest>& requests,
                        const std::vector<std::pair<std::string, std::string>>& preprocess,
                        const std::map<std::string, std::string>& camera) {
  const ConfigWriter writer(invocation, requests, camera);
  // What is known by its place has no key.
  std::string command = invocation.arguments->command();
  for (const Option& option : invocation.arguments->options()) {
    if (option.kind != Option::Kind::positional) continue;
    for (const std::string& text : option.texts) command += " " + text;
  }
  return fmt::format(
             "# `vrpipe {} --config THIS_FILE` does this; vrpipe {}. After each value is where it comes from.\n\n",
             command, VRPIPE_VERSION) +
         writer.options() + writer.units() + writer.variants() + writer.parameters(preprocess);
}

}  // namespace vrpipe::tools
