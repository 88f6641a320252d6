// Options of what has to do with firmware images. Templates over CLI11's command, whose header is in app.cpp alone.
#pragma once

#include "host/cli/drive_commands.hpp"
#include "host/cli/firmware_commands.hpp"

namespace flexspline::cli {

template <class Command>
void take_firmware(Command& flash, FlashOptions& options) {
  flash.add_option("--firmware", options.firmware, "firmware image of flexspline image, over USB")->type_name("IMAGE");
  flash.add_flag("--older", options.older, "with --firmware: an image older than what the drive has");
}

template <class Command>
void take_image(Command& image, ImageOptions& options) {
  image.add_option("--program", options.program, "BIN file of a linker, linked to start behind a header of 512 bytes")
      ->required()
      ->type_name("BIN");
  image.add_option("--board", options.board, "the board that it is for, as flexspline drives calls it")
      ->required()
      ->type_name("NAME");
  image.add_option("--version", options.version, "major and minor, as 1.2")->required()->type_name("N.N");
  image.add_option("--out", options.out, "file for the image")->required()->type_name("IMAGE");
  image.add_flag("--dfu", options.with_suffix, "with the suffix that dfu-util looks for");
}

}  // namespace flexspline::cli
