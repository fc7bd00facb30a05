#include <algorithm>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "catalogue/catalogue.h"

namespace vrpipe {

namespace {
std::vector<Platform>& list() {
  static std::vector<Platform> all{agx_orin(), mobile(), desktop(), agx_orin_lpddr3(), agx_orin_lpddr5(), gh100_gpc()};
  return all;
}
}  // namespace

const std::vector<Platform>& platforms() { return list(); }

void add_platform(Platform platform) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    if (!is_loading_plugin())
      throw UserError("cannot add platform '" + platform.name + "'", "add_platform", why, remedy);
    Registry::instance().add_problem({"platform '" + platform.name + "': " + why, remedy});
  };
  for (const Platform& known : list()) {
    if (known.name == platform.name) return refuse("there is one of that name", "choose another name");
  }
  if (platform.gpcs == 0 || !(platform.frequency_mhz > 0) || !platform.wire) {
    return refuse("it has no GPC, no frequency or no wiring", "set gpcs, frequency_mhz and wire");
  }
  list().push_back(std::move(platform));
  Registry::instance().count_registration();
}

const Platform& platform_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Platform& platform : list()) {
    if (platform.name == name) return platform;
    names.push_back(platform.name);
  }
  throw UserError("unknown platform '" + name + "'", "--platform", "there is no such platform",
                  "did you mean " + nearest_name(name, names) + "? `vrpipe platforms` lists all");
}

}  // namespace vrpipe
