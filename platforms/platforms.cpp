#include <algorithm>

#include <vrpipe/error.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

Platform agx_orin();
Platform mobile();
Platform desktop();

namespace {
std::vector<Platform>& list() {
  static std::vector<Platform> all{agx_orin(), mobile(), desktop()};
  return all;
}
}  // namespace

const std::vector<Platform>& platforms() { return list(); }

void add_platform(Platform platform) {
  for (const Platform& known : list()) {
    if (known.name == platform.name) {
      throw UserError("cannot add platform '" + platform.name + "'", "add_platform", "there is one of that name",
                      "choose another name");
    }
  }
  list().push_back(std::move(platform));
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
