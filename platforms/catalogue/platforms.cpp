#include <algorithm>

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "catalogue/catalogue.h"

namespace vrpipe {

namespace {
std::vector<Platform>& list() {
  static std::vector<Platform> all{agx_orin(),
                                   agx_orin_ideal_memory(),
                                   agx_orin_lpddr5(),
                                   agx_orin_emerald_2(),
                                   agx_orin_emerald_1(),
                                   mobile(),
                                   desktop(),
                                   gh100_gpc()};
  return all;
}
}  // namespace

const std::vector<Platform>& platforms() { return list(); }

void add_platform(Platform platform) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    if (!is_loading_plugin())
      throw UserError("cannot add platform '" + printable(platform.name) + "'", "add_platform", why, remedy);
    Registry::instance().add_problem({"platform '" + printable(platform.name) + "': " + why, remedy});
  };
  for (const Platform& known : list()) {
    if (known.name == platform.name) return refuse("there is one of that name", "choose another name");
  }
  if (!is_good_name(platform.name)) return refuse(std::string("its name is not ") + good_name_rule, "choose another");
  if (printable(platform.description) != platform.description)
    return refuse("its description is not one line of text", "leave out what is not");
  if (platform.gpcs == 0 || platform.gpcs > most_gpcs)
    return refuse("it has " + std::to_string(platform.gpcs) + " GPCs", "set 1 to " + std::to_string(most_gpcs));
  // A clock has periods of whole picoseconds.
  if (!(platform.frequency_mhz >= 0.001 && platform.frequency_mhz <= 1e6))
    return refuse("its frequency is not 0.001 to 1,000,000 MHz", "set frequency_mhz");
  if (!platform.wire) return refuse("it has no wiring", "set wire");
  list().push_back(std::move(platform));
  Registry::instance().count_registration();
}

const Platform& platform_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Platform& platform : list()) {
    if (platform.name == name) return platform;
    names.push_back(platform.name);
  }
  if (name == "agx-orin-lpddr3") {
    throw UserError("unknown platform '" + name + "'", "--platform", "agx-orin has its memory now",
                    "give agx-orin; what that was is agx-orin-ideal-memory");
  }
  throw UserError("unknown platform '" + name + "'", "--platform", "there is no such platform",
                  suggestion(name, names, "`vrpipe platforms` lists all"));
}

}  // namespace vrpipe
