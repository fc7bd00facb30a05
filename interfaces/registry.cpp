#include <vrpipe/registry.h>

#include <algorithm>

#include <dlfcn.h>

#include <filesystem>
#include <system_error>

#include "plugin_tag.h"

#include <vrpipe/checked_behaviours.h>
#include <vrpipe/error.h>

namespace vrpipe {

Registry& Registry::instance() {
  static Registry registry;
  return registry;
}

const std::vector<std::string>& Registry::slots() {
  static const std::vector<std::string> names{"draw", "vpo",  "tgc", "raster", "tc",
                                              "prop", "zrop", "qru", "sm",     "crop"};
  return names;
}

void Registry::add(Implementation implementation) {
  if (std::find(slots().begin(), slots().end(), implementation.slot) == slots().end()) {
    return add_problem({"there is no slot '" + implementation.slot + "' for its unit '" + implementation.name + "'",
                        "did you mean " + nearest_name(implementation.slot, slots()) + "?"});
  }
  for (const auto& known : implementations_) {
    if (known->slot == implementation.slot && known->name == implementation.name) {
      return add_problem(
          {"slot " + implementation.slot + " has an implementation '" + implementation.name + "' already",
           "choose another name"});
    }
  }
  if (implementation.trust == Trust::checked) check_calls(implementation);
  count_registration();
  implementations_.push_back(std::make_unique<Implementation>(std::move(implementation)));
}

const Implementation& Registry::find(const std::string& slot, const std::string& name) const {
  if (std::find(slots().begin(), slots().end(), slot) == slots().end()) {
    throw UserError("unknown slot '" + slot + "'", "--unit", "no such slot",
                    "did you mean " + nearest_name(slot, slots()) + "? `vrpipe units` lists all");
  }
  std::vector<std::string> names;
  for (const Implementation* implementation : of_slot(slot)) {
    if (implementation->name == name) return *implementation;
    names.push_back(implementation->name);
  }
  throw UserError("unknown unit '" + name + "'", "slot " + slot, "nothing of that name is registered",
                  "did you mean " + nearest_name(name, names) + "? `vrpipe units` lists all");
}

std::vector<const Implementation*> Registry::of_slot(const std::string& slot) const {
  std::vector<const Implementation*> found;
  for (const auto& implementation : implementations_) {
    if (implementation->slot == slot) found.push_back(implementation.get());
  }
  std::sort(found.begin(), found.end(),
            [](const Implementation* a, const Implementation* b) { return a->name < b->name; });
  return found;
}

std::vector<const Implementation*> Registry::all() const {
  std::vector<const Implementation*> found;
  for (const std::string& slot : slots()) {
    for (const Implementation* implementation : of_slot(slot)) found.push_back(implementation);
  }
  return found;
}

namespace {
// Plugins are never unloaded, not even at exit: the registry holds code of theirs.
std::vector<std::string>& plugins() {
  static auto& paths = *new std::vector<std::string>;
  return paths;
}
bool loading = false;
struct Loading {
  Loading() { loading = true; }
  ~Loading() { loading = false; }
};
}  // namespace

const std::vector<std::string>& loaded_plugins() { return plugins(); }
bool is_loading_plugin() { return loading; }

void load_plugin(const std::string& path) {
  const std::string remedy = "build it with this vrpipe's vrpipe_add_plugin()";
  const std::string path_remedy = "give the path of a plugin's .so";
  std::error_code status_error;
  const std::filesystem::file_status status = std::filesystem::status(path, status_error);
  if (status.type() == std::filesystem::file_type::none) {
    throw UserError("cannot load plugin", path, status_error.message(), path_remedy);
  }
  if (!std::filesystem::exists(status)) {
    throw UserError("cannot load plugin", path, "there is no such file", path_remedy);
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw UserError("cannot load plugin", path, "it is not a regular file", path_remedy);
  }
  const std::string tag = plugin_tag(path);
  if (tag.empty()) throw UserError("cannot load plugin", path, "it is not a vrpipe plugin", remedy);
  if (tag != VRPIPE_PLUGIN_TAG) {
    throw UserError("cannot load plugin", path, "it was built for " + tag + ", this is " VRPIPE_PLUGIN_TAG, remedy);
  }
  // A name without a folder would be looked for among the system's libraries.
  const std::string file = path.find('/') == std::string::npos ? "./" + path : path;
  if (dlopen(file.c_str(), RTLD_NOW | RTLD_NOLOAD) != nullptr) {
    throw UserError("cannot load plugin", path, "it is loaded already", "give it once");
  }
  Registry& registry = Registry::instance();
  const std::size_t before = registry.registrations();
  registry.take_problems();
  void* library = nullptr;
  {
    const ForeignCall running(file.c_str(), "while it is loaded");
    const Loading now;
    library = dlopen(file.c_str(), RTLD_NOW);
  }
  if (library == nullptr) {
    const char* const detail = dlerror();
    throw UserError("cannot load plugin", path, detail != nullptr ? detail : "the loader refuses it", remedy);
  }
  plugins().push_back(path);
  const std::vector<Registry::Problem> problems = registry.take_problems();
  if (!problems.empty()) throw UserError("cannot load plugin", path, problems.front().why, problems.front().remedy);
  if (registry.registrations() == before) {
    throw UserError("cannot load plugin", path, "it registers no unit and no platform",
                    "register one with Registrar or add_platform");
  }
}

}  // namespace vrpipe
