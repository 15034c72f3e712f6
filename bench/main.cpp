#include "bench/commands/program.h"

int main(int argc, char** argv) {
  return ricochet::run_program(argc, argv);
}
