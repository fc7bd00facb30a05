#include "cli/command_line.h"
#include "host/process_setup.h"

int main(int argc, char** argv) {
  vrpipe::tools::set_up_process();
  return vrpipe::tools::run_command_line(argc, argv);
}
