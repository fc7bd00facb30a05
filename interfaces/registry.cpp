#include <vrpipe/registry.h>

#include <algorithm>
#include <cerrno>

#include <dlfcn.h>

#include <filesystem>
#include <fstream>
#include <system_error>

#include <boost/dll/shared_library.hpp>

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
  for (const auto& known : implementations_) {
    if (known->slot == implementation.slot && known->name == implementation.name) {
      problems_.push_back("slot " + implementation.slot + " has an implementation '" + implementation.name +
                          "' already");
      return;
    }
  }
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

/// The tag that VRPIPE_PLUGIN left in the file, without loading it; empty when there is none.
std::string tag_in_file(const std::string& path) {
  // Part by part: whatever was named may be larger than memory. Each begins with the end of the one before.
  constexpr std::size_t part_bytes = std::size_t{1} << 20U;
  constexpr std::size_t longest_tag = 256;
  const std::string mark = "vrpipe-plugin/";
  std::ifstream file(path, std::ios::binary);
  if (!file) throw UserError("cannot load plugin", path, std::generic_category().message(errno), "make it readable");
  std::string content(4, '\0');
  file.read(&content[0], 4);
  if (content != "\177ELF") return {};  // no shared object, such as a scene of gigabytes
  do {
    content.erase(0, content.size() - std::min(content.size(), longest_tag));
    const std::size_t kept = content.size();
    content.resize(kept + part_bytes);
    file.read(&content[kept], part_bytes);
    content.resize(kept + static_cast<std::size_t>(file.gcount()));
    const std::size_t start = content.find(mark);
    const bool is_whole = start != std::string::npos && (content.size() - start >= longest_tag || !file);
    if (is_whole) return content.substr(start, std::min(content.find('\0', start) - start, longest_tag));
  } while (file);
  return {};
}

}  // namespace

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
  const std::string tag = tag_in_file(path);
  if (tag.empty()) throw UserError("cannot load plugin", path, "it is not a vrpipe plugin", remedy);
  if (tag != VRPIPE_PLUGIN_TAG) {
    throw UserError("cannot load plugin", path, "it was built for " + tag + ", this is " VRPIPE_PLUGIN_TAG, remedy);
  }
  const std::size_t before = Registry::instance().all().size();
  // Plugins are never unloaded, not even at exit: the registry holds code of theirs.
  static auto& loaded = *new std::vector<boost::dll::shared_library>;
  boost::dll::fs::error_code error;
  boost::dll::shared_library library(path, error, boost::dll::load_mode::rtld_now);
  if (error) {
    const char* const detail = dlerror();
    throw UserError("cannot load plugin", path, detail != nullptr ? detail : "the loader refuses it", remedy);
  }
  loaded.push_back(std::move(library));
  if (!Registry::instance().problems().empty()) {
    throw UserError("cannot load plugin", path, Registry::instance().problems().front(), "choose another name");
  }
  if (Registry::instance().all().size() == before) {
    throw UserError("cannot load plugin", path, "it registers no unit", "register one with Registrar");
  }
}

}  // namespace vrpipe
