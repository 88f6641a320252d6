#include "host/app/cli/app.hpp"

int main(int argc, char** argv) {
  return flexspline::cli::run(argc, argv);
}
