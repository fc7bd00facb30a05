#include "jobs/termination.h"

#include <vrpipe/error.h>

namespace vrpipe::tools {

Termination termination_named(const std::string& name) {
  for (const Termination termination : {Termination::paper, Termination::strict}) {
    if (name == name_of(termination)) return termination;
  }
  throw UserError("unknown termination '" + name + "'", "--termination", "there is no such rule",
                  "use paper or strict");
}

const char* name_of(Termination termination) { return termination == Termination::paper ? "paper" : "strict"; }

}  // namespace vrpipe::tools
