#include "prop/prop.h"

#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {
const SlotRegistrar prop_slot{{"prop", 60, "pre-rop", "", true, check_prop}, {}, {way_of_late_tests()}};
const Registrar<PreRop, PropBehaviour> registrar("prop", "pre-rop", "quad flow between TC, ZROP, SM and CROP, in order",
                                                 false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
