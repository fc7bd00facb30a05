#include "command_line.h"
#include "process_setup.h"

int main(int argc, char** argv) {
  vrpipe::tools::set_up_process();
  return vrpipe::tools::run_command_line(argc, argv);
}
