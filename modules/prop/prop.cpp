#include "prop/prop.h"

#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

PreRop::PreRop(const Parameters& parameters, const RenderContext& context)
    : timing_{parameters.quads_per_cycle,
              Rate::of_bytes(parameters.color_bytes_per_cycle, 4 * bytes_per_pixel(context.format)),
              parameters.latency_cycles, static_cast<Order>(static_cast<unsigned>(parameters.order))} {}

namespace {
const SlotRegistrar prop_slot{{"prop", 60, "pre-rop", "", true, check_prop}, {}, {way_of_late_tests()}};
const Registrar<PreRop, PropBehaviour> registrar("prop", "pre-rop", "quad flow between TC, ZROP, SM and CROP, in order",
                                                 false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
