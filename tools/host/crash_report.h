#pragma once

#include <string>

namespace vrpipe::tools {

/// For when code of plugins runs: from here on a crash, a call of exit() or an exception that nothing catches ends in
/// one line on stderr that names the code, the plugins and `where`, and in exit code 1. The last call counts.
void report_crashes(const std::string& where = "");
/// The same for a process whose parent reports: `mark` and the text go to a descriptor, and the exit code is 0.
void report_crashes_to(int descriptor, char mark);

}  // namespace vrpipe::tools
