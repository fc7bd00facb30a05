#include "command_line.h"

int main(int argc, char** argv) { return vrpipe::tools::run_command_line(argc, argv); }
