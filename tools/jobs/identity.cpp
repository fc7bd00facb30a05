#include "jobs/identity.h"

#include <sha2.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/scene.h>
#include <vrpipe/workloads/scene_substitution.h>

namespace vrpipe::tools {

namespace fs = std::filesystem;
nlohmann::json file_identity(const std::string& name) {
  std::error_code ignored;
  const fs::path path = fs::weakly_canonical(name, ignored);
  const auto of_file = [](const fs::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return nlohmann::json();
    return nlohmann::json{{"path", valid_utf8(file.string())},
                          {"bytes", status.st_size},
                          {"modified", {status.st_mtim.tv_sec, status.st_mtim.tv_nsec}}};
  };
  if (!fs::is_directory(path, ignored)) return of_file(path);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(path, ignored)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  nlohmann::json all = nlohmann::json::array();
  for (const fs::path& file : files) all.push_back(of_file(file));
  return all;
}

nlohmann::json scene_identity(const std::string& scene) {
  if (scene.empty() || builtin_name_of(scene)) return scene_name(scene);
  const std::string file = gaussian_file_path(scene_file(scene));
  nlohmann::json identity = file_identity(file);
  if (!identity.is_object()) identity = {{"files", identity}};
  // The file's path, of which there are several, is there already.
  identity["name and part"] = valid_utf8(std::string(scene).replace(scene.rfind(file), file.size(), "FILE"));
  return identity;
}

nlohmann::json settings_identity(const std::vector<Setting>& settings) {
  nlohmann::json all = nlohmann::json::array();
  for (const Setting& setting : settings) {
    all.push_back(valid_utf8(setting.unit + "." + setting.parameter + "=" + setting.value));
  }
  return all;
}

nlohmann::json request_identity(const RunRequest& request) {
  const auto units = [](const std::vector<UnitChoice>& choices) {
    nlohmann::json all = nlohmann::json::array();
    for (const UnitChoice& unit : choices) all.push_back(valid_utf8(unit.slot + "=" + unit.implementation));
    return all;
  };
  const Variant& variant = request.variant;
  nlohmann::json sampling;
  if (request.sampling) sampling = {request.sampling->windows, request.sampling->seed, request.error_percent};
  return {{"sampling", std::move(sampling)},
          {"platform", valid_utf8(request.platform->name)},
          {"variant",
           {valid_utf8(variant.name), valid_utf8(variant.base), units(variant.changed_units),
            settings_identity(variant.changed_settings)}},
          {"fidelity", fidelity_of(request)},
          {"effects", request.effects.text()},
          {"format", vrpipe::name_of(request.format)},
          {"termination", name_of(request.termination)},
          {"set", settings_identity(request.settings)},
          {"unit", units(request.units)}};
}

std::string sha256(const std::string& text) {
  std::array<char, SHA256_DIGEST_STRING_LENGTH> digits{};
  ::SHA256Data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), digits.data());
  return digits.data();
}

}  // namespace vrpipe::tools
