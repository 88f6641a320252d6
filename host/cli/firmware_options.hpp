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
void take_image(const Command& command) {
  auto& image = *command.first;
  ImageOptions& options = *command.second;
  image.add_option("--program", options.program, "BIN file of a linker, linked to start behind a header of 512 bytes")
      ->required()
      ->type_name("BIN");
  image.add_option("--board", options.board, "the board that it is for, as flexspline drives calls it")
      ->required()
      ->type_name("NAME");
  image.add_option("--version", options.version, "major and minor, as 1.2")->required()->type_name("N.N");
  image.add_option("--out", options.out, "file for the image")->required()->type_name("IMAGE");
  image.add_flag("--dfu", options.with_suffix, "with the suffix that dfu-util looks for");
  image.add_option("--key", options.key, "sign with this key of flexspline key (default: the public development key)")
      ->type_name("KEY");
  image.add_option("--counter", options.counter, "security counter: a drive takes no smaller one than it has run (0)")
      ->type_name("N");
  image.add_flag("--unsigned", options.is_unsigned, "without a signature; flexspline sign adds it later");
}

template <class Command>
void take_sign(const Command& command) {
  auto& sign = *command.first;
  SignOptions& options = *command.second;
  sign.add_option("--image", options.image, "firmware image of flexspline image")->required()->type_name("IMAGE");
  sign.add_option("--key", options.key, "file of flexspline key --new")->required()->type_name("KEY");
  sign.add_option("--out", options.out, "file for the signed image")->required()->type_name("IMAGE");
  sign.add_option("--counter", options.counter, "security counter (default: the one that the image has)")
      ->type_name("N");
  sign.add_flag("--dfu", options.with_suffix, "with the suffix that dfu-util looks for");
}

template <class Command>
void take_key(const Command& command) {
  auto& key = *command.first;
  KeyOptions& options = *command.second;
  key.add_option("--new", options.make, "make a pair of keys and write it into this file")->type_name("KEY");
  key.add_option("--show", options.show, "print the public key of this file")->type_name("KEY");
}

}  // namespace flexspline::cli
