// A module in the place of a shipped one.
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool registered = [] {
  vrpipe::register_unit_maker("zrop",
                              [](const std::string&, vrpipe::ClockDomain&, std::unique_ptr<vrpipe::Behaviour>,
                                 const vrpipe::RenderContext&,
                                 unsigned) -> std::unique_ptr<vrpipe::Unit> { return nullptr; });
  return true;
}();
}  // namespace
