#include "jobs/frame_file.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/mesh.h>
#include <vrpipe/workloads/scene.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "file_io.h"

namespace vrpipe::tools {
namespace {

using FrameJson = nlohmann::json;

constexpr const char* cannot_use_frame = "cannot use frame file";
constexpr const char* early_termination_key = "early_termination";
constexpr const char* command_remedy = "give {\"draw\": SCENE} or {\"clear\": [...]}";

[[noreturn]] void refuse_frame(const std::string& where, const std::string& why, const std::string& remedy) {
  throw UserError(cannot_use_frame, where, why, remedy);
}

/// For a name that is none of those known.
[[noreturn]] void refuse_unknown(const std::string& where, const std::string& kind, const std::string& name,
                                 const std::vector<std::string>& known) {
  refuse_frame(where, fmt::format("unknown {} '{}'", kind, name), suggestion(name, known));
}

void check_keys(const FrameJson& object, const std::vector<std::string>& known, const std::string& where) {
  for (const auto& entry : object.items()) {
    if (std::find(known.begin(), known.end(), entry.key()) == known.end()) {
      refuse_unknown(where, "key", entry.key(), known);
    }
  }
}

/// A value in a message; of an array or an object only that it is one.
std::string shown(const FrameJson& value) {
  if (value.is_array()) return "an array";
  return value.is_object() ? "an object" : value.dump();
}

const std::string& text_at(const FrameJson& value, const std::string& where) {
  if (!value.is_string() || value.get_ref<const std::string&>().empty()) {
    refuse_frame(where, "it is " + shown(value) + ", not a text", "write a text in quotes");
  }
  return value.get_ref<const std::string&>();
}

/// Parses JSON. The library would take the last of two keys of one name, and a draw would be missing.
FrameJson parse(const std::string& text, const std::string& where) {
  std::vector<std::set<std::string>> keys;  // of the objects that the parser is in
  const auto check = [&](int, FrameJson::parse_event_t event, FrameJson& parsed) {
    if (event == FrameJson::parse_event_t::object_start) keys.emplace_back();
    if (event == FrameJson::parse_event_t::object_end) keys.pop_back();
    if (event == FrameJson::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second) {
      refuse_frame(where, "an object has the key " + parsed.dump() + " twice", "keep one of the two");
    }
    return true;
  };
  try {
    return FrameJson::parse(text, check);
  } catch (const FrameJson::exception& error) {
    const std::string why = error.what();
    refuse_frame(where, "it is not valid JSON: " + why.substr(why.find("] ") + 2), "correct the file");
  }
}

/// One of several names, in the order of an enumeration.
template <class Enumeration>
Enumeration read_choice(const FrameJson& value, const std::vector<std::string>& names, const std::string& kind,
                        const std::string& where) {
  const std::string& name = text_at(value, where);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) refuse_unknown(where, kind, name, names);
  return static_cast<Enumeration>(found - names.begin());
}

// As the graphics APIs have them; LESS passes what is less than what is stored.
const std::vector<std::string> compare_names{"never",   "less",      "equal",         "less_equal",
                                             "greater", "not_equal", "greater_equal", "always"};
const std::vector<std::string> operation_names{"keep",      "zero",   "replace",        "increment",
                                               "decrement", "invert", "increment_wrap", "decrement_wrap"};
const std::vector<std::string> shader_names{"splat", "vertex", "lit", "none"};
const std::vector<std::string> cull_names{"none", "back", "front"};

bool read_switch(const FrameJson& value, const std::string& where) {
  if (!value.is_boolean()) refuse_frame(where, "it is " + shown(value), "give true or false");
  return value.get<bool>();
}

std::uint8_t read_stencil_value(const FrameJson& value, const std::string& where) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > stencil_bits) {
    refuse_frame(where, "it is " + shown(value), "give 0 to 127: the highest bit is termination's");
  }
  return value.get<std::uint8_t>();
}

DepthState read_depth(const FrameJson& value, const std::string& where) {
  if (!value.is_object()) refuse_frame(where, "it is not an object", "give {\"compare\": \"less\", \"write\": true}");
  check_keys(value, {"compare", "write"}, where);
  DepthState depth;
  depth.test = true;
  if (value.contains("compare")) {
    depth.compare = read_choice<Compare>(value["compare"], compare_names, "function", where + ".compare");
  }
  if (value.contains("write")) depth.write = read_switch(value["write"], where + ".write");
  return depth;
}

StencilFace read_face(const FrameJson& value, const std::string& where) {
  if (!value.is_object())
    refuse_frame(where, "it is not an object", "give {\"compare\": \"equal\", \"reference\": 1, ...}");
  check_keys(value, {"compare", "stencil_fail", "depth_fail", "pass", "reference", "read_mask", "write_mask"}, where);
  StencilFace face;
  if (value.contains("compare")) {
    face.compare = read_choice<Compare>(value["compare"], compare_names, "function", where + ".compare");
  }
  for (const auto& [key, operation] : {std::pair{"stencil_fail", &face.stencil_fail},
                                       std::pair{"depth_fail", &face.depth_fail}, std::pair{"pass", &face.pass}}) {
    if (!value.contains(key)) continue;
    *operation = read_choice<StencilOperation>(value[key], operation_names, "operation", where + "." + key);
  }
  for (const auto& [key, member] : {std::pair{"reference", &face.reference}, std::pair{"read_mask", &face.read_mask},
                                    std::pair{"write_mask", &face.write_mask}}) {
    if (value.contains(key)) *member = read_stencil_value(value[key], where + "." + key);
  }
  return face;
}

/// Of both faces alike, or of each.
StencilState read_stencil(const FrameJson& value, const std::string& where) {
  StencilState stencil;
  stencil.test = true;
  if (!value.is_object() || (!value.contains("front") && !value.contains("back"))) {
    stencil.front = stencil.back = read_face(value, where);
    return stencil;
  }
  check_keys(value, {"front", "back"}, where);
  if (value.contains("front")) stencil.front = read_face(value["front"], where + ".front");
  if (value.contains("back")) stencil.back = read_face(value["back"], where + ".back");
  return stencil;
}

Clear read_clear(const FrameJson& value, const std::string& where) {
  const std::string remedy = "give [\"color\"], or several of color, termination, depth, stencil";
  if (!value.is_array() || value.empty()) refuse_frame(where, "it does not say what is cleared", remedy);
  Clear clear;
  for (const FrameJson& part : value) {
    const std::string& name = text_at(part, where);
    if (name == "color") {
      clear.color = true;
    } else if (name == "termination") {
      clear.termination = true;
    } else if (name == "depth") {
      clear.depth = true;
    } else if (name == "stencil") {
      clear.stencil = true;
    } else {
      refuse_unknown(where, "part of the framebuffer", name, {"color", "termination", "depth", "stencil"});
    }
  }
  return clear;
}

void read_splats(const FrameJson& value, const std::string& where, SceneDraw& draw) {
  constexpr std::uint64_t most = 0x80000000;
  const auto is_count = [](const FrameJson& number) {
    return number.is_number_unsigned() && number.get<std::uint64_t>() <= most;
  };
  if (!value.is_array() || value.size() != 2 || !is_count(value[0]) || !is_count(value[1])) {
    refuse_frame(where, "it is not an array of two whole numbers from 0 to 2^31", "give [FIRST, COUNT]");
  }
  draw.first = value[0].get<std::uint32_t>();
  draw.splats = value[1].get<std::uint32_t>();
}

/// A parameter's value as --set would have it. Numbers are numbers and choices are texts, as in results.
std::string parameter_words(const Parameter& parameter, const FrameJson& value, const std::string& where) {
  if (dynamic_cast<const Choice*>(&parameter) != nullptr) return text_at(value, where);
  if (!value.is_number()) refuse_frame(where, "it is " + shown(value) + ", not a number", "give " + parameter.range());
  return value.dump();
}

void read_state(const FrameJson& value, const std::string& where, SceneDraw& draw) {
  if (!value.is_object()) refuse_frame(where, "it is not an object", "give {\"PARAMETER\": VALUE, ...}");
  StateParameters parameters;
  const std::vector<Parameter*> of_draws = parameters.of_draws();
  std::vector<std::string> known{early_termination_key, "blend", "depth", "stencil", "late_tests", "shader", "cull"};
  for (const Parameter* parameter : of_draws) known.emplace_back(parameter->name());
  for (const auto& entry : value.items()) {
    const std::string& key = entry.key();
    const std::string here = where + "." + key;
    if (key == early_termination_key) {
      draw.early_termination = read_switch(entry.value(), here);
      continue;
    }
    if (key == "blend") {
      draw.blend = read_switch(entry.value(), here);
      continue;
    }
    if (key == "depth") {
      draw.depth = read_depth(entry.value(), here);
      continue;
    }
    if (key == "stencil") {
      draw.stencil = read_stencil(entry.value(), here);
      continue;
    }
    if (key == "late_tests") {
      draw.late_tests = read_switch(entry.value(), here);
      continue;
    }
    if (key == "shader") {
      draw.shader = read_choice<FragmentShader>(entry.value(), shader_names, "shader", here);
      continue;
    }
    if (key == "cull") {
      draw.cull = read_choice<CullMode>(entry.value(), cull_names, "side", here);
      continue;
    }
    const auto is_named = [&](const Parameter* parameter) { return key == parameter->name(); };
    const auto found = std::find_if(of_draws.begin(), of_draws.end(), is_named);
    if (found == of_draws.end()) {
      const std::vector<Parameter*>& all = parameters.parameters();
      if (std::none_of(all.begin(), all.end(), is_named)) refuse_unknown(where, "parameter", key, known);
      refuse_frame(here, "it is the precision of the hardware, which all draws share",
                   "use --set state." + key + "=VALUE");
    }
    const std::string text = parameter_words(**found, entry.value(), here);
    (*found)->set(text, here);
    draw.settings.push_back({"state", key, text});
  }
}

SceneDraw read_draw(const FrameJson& command, const std::string& where, const std::filesystem::path& folder) {
  SceneDraw draw;
  draw.scene = text_at(command["draw"], where + ", draw");
  const bool is_file = !builtin_name_of(draw.scene);
  const auto in_folder = [&folder](const std::string& file) { return (folder / file).lexically_normal().string(); };
  const auto in_place = scene_substitution(draw.scene);
  if (in_place) {
    draw.scene = in_place->name + "=" + in_folder(in_place->file);
  } else if (is_file) {
    draw.scene = in_folder(draw.scene);
  }
  draw.is_mesh = is_file && !in_place && !is_draw_list(draw.scene) && std::filesystem::is_regular_file(draw.scene) &&
                 is_mesh_file(draw.scene);
  if (draw.is_mesh && command.contains("splats")) {
    refuse_frame(where + ", splats", "it is a mesh, which has none", "leave it out");
  }
  if (command.contains("name")) draw.name = text_at(command["name"], where + ", name");
  if (command.contains("splats")) read_splats(command["splats"], where + ", splats", draw);
  if (command.contains("state")) read_state(command["state"], where + ", state", draw);
  const FragmentShader shader = draw.shader.value_or(FragmentShader::none);
  if (shader != FragmentShader::none && draw.is_mesh == (shader == FragmentShader::splat)) {
    refuse_frame(where + ", state.shader", draw.is_mesh ? "it is that of splats" : "it is that of a mesh",
                 draw.is_mesh ? "use lit, vertex or none" : "use splat or none");
  }
  if (!draw.blend && draw.early_termination.value_or(false)) {
    refuse_frame(where + ", state.early_termination", "the draw does not blend, so that no pixel's alpha grows",
                 "leave it out, or blend");
  }
  if (draw.late_tests && draw.shader == FragmentShader::none) {
    refuse_frame(where + ", state.late_tests", "its tests are to come after shading, and its shader is none",
                 "leave it out, or use another shader");
  }
  return draw;
}

FrameCommand read_command(const FrameJson& json, const std::string& where, const std::filesystem::path& folder) {
  if (!json.is_object()) refuse_frame(where, "it is not an object", command_remedy);
  FrameCommand command;
  command.where = where;
  if (json.contains("clear")) {
    if (json.contains("draw"))
      refuse_frame(where, "it has other keys beside \"clear\"", "make another command of them");
    check_keys(json, {"clear", "depth", "stencil"}, where);
    command.clear = read_clear(json["clear"], where + ", clear");
    const auto value_of = [&](const char* key, bool is_cleared) {
      if (json.contains(key) && !is_cleared) {
        refuse_frame(where, fmt::format("it has a value for {}, which is not cleared", key),
                     "add it to the list, or leave it out");
      }
      return json.contains(key);
    };
    if (value_of("depth", command.clear.depth)) {
      const FrameJson& depth = json["depth"];
      if (!depth.is_number() || !(depth.get<double>() >= 0 && depth.get<double>() <= 1)) {
        refuse_frame(where + ", depth", "it is " + shown(depth), "give 0 to 1");
      }
      command.clear.depth_value = depth.get<float>();
    }
    if (value_of("stencil", command.clear.stencil)) {
      command.clear.stencil_value = read_stencil_value(json["stencil"], where + ", stencil");
    }
    return command;
  }
  check_keys(json, {"draw", "name", "splats", "state", "clear"}, where);
  if (!json.contains("draw")) refuse_frame(where, "it has neither \"draw\" nor \"clear\"", command_remedy);
  command.draw = read_draw(json, where, folder);
  return command;
}

/// A draw without a name is called what it draws, with a number where several are.
void name_draws(std::vector<FrameCommand>& commands) {
  std::map<std::string, unsigned> unnamed;
  for (const FrameCommand& command : commands) {
    if (command.draw && command.draw->name.empty()) ++unnamed[scene_name(command.draw->scene)];
  }
  std::map<std::string, unsigned> named;
  for (FrameCommand& command : commands) {
    if (!command.draw || !command.draw->name.empty()) continue;
    const std::string name = scene_name(command.draw->scene);
    command.draw->name = unnamed[name] > 1 ? fmt::format("{} {}", name, ++named[name]) : name;
  }
}

}  // namespace

void leave_out_draws_after(std::size_t count, FrameDescription& frame) {
  std::size_t draws = 0;
  for (std::size_t i = 0; i < frame.commands.size(); ++i) {
    if (!frame.commands[i].draw || ++draws < count) continue;
    frame.commands.resize(i + 1);
    return;
  }
  throw UserError("bad value '" + std::to_string(count) + "'", "--draws",
                  fmt::format("{} has {} draw{}", frame.name, draws, draws == 1 ? "" : "s"), "give fewer");
}

FrameDescription frame_of_scene(const std::string& scene) {
  FrameDescription frame;
  frame.name = scene_name(scene);
  frame.commands.resize(1);
  frame.commands.front().where = "--scene";
  SceneDraw& draw = frame.commands.front().draw.emplace();
  draw.scene = scene;
  draw.name = frame.name;
  return frame;
}

FrameDescription read_frame_file(const std::filesystem::path& path) {
  const std::string where = path.string();
  const InputFile file(path, "cannot read frame file");
  std::string text(static_cast<std::size_t>(file.size()), '\0');
  file.read(0, text.data(), text.size());
  file.check_unchanged();
  const FrameJson json = parse(text, where);
  const std::string layout = "give {\"commands\": [{\"draw\": SCENE}, ...]}";
  if (!json.is_object()) refuse_frame(where, "it is not an object", layout);
  check_keys(json, {"commands"}, where);
  if (!json.contains("commands")) refuse_frame(where, "it has no \"commands\"", layout);
  const FrameJson& commands = json["commands"];
  if (!commands.is_array()) refuse_frame(where + ", commands", "it is not an array", layout);

  FrameDescription frame;
  frame.name = path.filename().string();
  for (const FrameJson& command : commands) {
    frame.commands.push_back(
        read_command(command, fmt::format("{}, command {}", where, frame.commands.size() + 1), path.parent_path()));
  }
  const auto draws = [](const FrameCommand& command) { return command.draw.has_value(); };
  if (std::none_of(frame.commands.begin(), frame.commands.end(), draws)) {
    refuse_frame(where + ", commands", "nothing is drawn", layout);
  }
  name_draws(frame.commands);
  return frame;
}

}  // namespace vrpipe::tools
