#include <vrpipe/pipeline/registry.h>

#include <algorithm>

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "component/plugin_tag.h"

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/pipeline/checked_behaviours.h>

namespace vrpipe {

Registry& Registry::instance() {
  static Registry registry;
  return registry;
}

void Registry::add(Slot slot) {
  if (!is_good_name(slot.name)) return add_bad_name("slot", slot.name);
  if (has_slot(slot.name)) {
    return add_problem({"there is a slot '" + slot.name + "' already", "choose another name"});
  }
  const auto place = std::upper_bound(slots_.begin(), slots_.end(), slot,
                                      [](const Slot& a, const Slot& b) { return a.rank < b.rank; });
  slots_.insert(place, std::move(slot));
  count_registration();
}

bool Registry::has_slot(const std::string& name) const {
  return std::any_of(slots_.begin(), slots_.end(), [&](const Slot& slot) { return slot.name == name; });
}

const Slot& Registry::slot(const std::string& name) const {
  for (const Slot& slot : slots_) {
    if (slot.name == name) return slot;
  }
  throw UserError("unknown slot '" + name + "'", "--unit", "no such slot",
                  suggestion(name, slot_names(), "`vrpipe units` lists all"));
}

std::vector<std::string> Registry::slot_names() const {
  std::vector<std::string> names;
  for (const Slot& slot : slots_) names.push_back(slot.name);
  return names;
}

void Registry::add_bad_name(const std::string& what, const std::string& name) {
  add_problem({"the name '" + printable(name) + "' of a " + what + " is not " + good_name_rule, "choose another name"});
}

void Registry::add(Implementation implementation) {
  if (!is_good_name(implementation.name)) return add_bad_name("unit", implementation.name);
  if (!has_slot(implementation.slot)) {
    return add_problem({"there is no slot '" + implementation.slot + "' for its unit '" + implementation.name + "'",
                        suggestion(implementation.slot, slot_names())});
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
  static_cast<void>(this->slot(slot));
  std::vector<std::string> names;
  for (const Implementation* implementation : of_slot(slot)) {
    if (implementation->name == name) return *implementation;
    names.push_back(implementation->name);
  }
  throw UserError("unknown unit '" + name + "'", "slot " + slot, "nothing of that name is registered",
                  suggestion(name, names, "`vrpipe units` lists all"));
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
  for (const Slot& slot : slots_) {
    for (const Implementation* implementation : of_slot(slot.name)) found.push_back(implementation);
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
    // A plugin's constructors may throw, though glibc declares that dlopen does not: a compiler that sees the declaration
    // may leave out what has to be undone then.
    void* (*const volatile load)(const char*, int) = dlopen;
    call_with_fault([&] { library = load(file.c_str(), RTLD_NOW); },
                    [&](const char* text) {
                      throw std::runtime_error(file + ", while it is loaded: throws " +
                                               (text != nullptr ? text : "what is no std::exception"));
                    });
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
