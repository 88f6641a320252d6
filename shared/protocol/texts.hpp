// Texts for codes, refusals, faults and channels. For the host; they are in no image.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "shared/protocol/payloads.hpp"

namespace flexspline::protocol {

// Of the parameter store.
constexpr std::string_view store_text_of(Code code) {
  switch (code) {
    case Code::too_long:
      return "the block is empty or longer than the drive's flash has room for";
    case Code::not_begun:
      return "no block is being sent; start again";
    case Code::out_of_order:
      return "a piece of the block is missing; start again";
    case Code::incomplete:
      return "the block is not complete; start again";
    case Code::wrong_checksum:
      return "what arrived is not what was sent; try again over a better line";
    case Code::invalid:
      return "the drive's validator refused the block; nothing was changed";
    case Code::flash:
      return "the drive's flash memory did not take what was written; try again, and if it stays the memory is worn "
             "out";
    case Code::no_previous:
      return "there is no valid block before the active one; flash one from a backup";
    case Code::worn:
      return "there is no room to note another restore; flash the block from a backup";
    default:
      return {};
  }
}

constexpr std::string_view text_of(Code code) {
  switch (code) {
    case Code::done:
      return "done";
    case Code::unknown_request:
      return "the drive's firmware does not know this request; bring the firmware up to date";
    case Code::wrong_length:
      return "the drive's firmware expects another length of this request; bring tool and firmware to one version";
    case Code::wrong_value:
      return "a number in the request is outside what the drive takes";
    case Code::wrong_version:
      return "tool and firmware speak different versions; bring both to one version";
    case Code::busy:
      return "the drive still works on the request before; try again";
    case Code::armed:
      return "that cannot be changed while the drive is armed; disarm it first";
    case Code::refused:
      return "the drive refused the command";
    case Code::no_parameters:
      return "the drive has no parameters in use; flash a block first";
    case Code::no_block:
      return "the drive has no such block";
    case Code::not_available:
      return "this drive cannot do that";
    case Code::moving:
      return "the shaft turns, and writing flash memory would lose counts of it; bring it to rest first";
    case Code::locked:
      return "its parameters are locked by a pairing key; give the key's file with --pairing-key";
    case Code::not_paired:
      return "it is not paired with a key; leave --pairing-key out, or lock it with flexspline pair";
    case Code::other_key:
      return "it is paired with another key; give the file of that one (flexspline pair shows its fingerprint)";
    case Code::wrong_signature:
      return "it did not accept the signature of its challenge; does another program speak with it? Try again";
    case Code::wait:
      return "it waits after wrong signatures; try again in a minute";
    case Code::pairing_full:
      return "its memory for pairing keys is full; its sector has to be erased with a programmer";
    case Code::not_measured:
      return "it has not measured its motor since it was switched on; run flexspline commission";
    case Code::too_long:
    case Code::not_begun:
    case Code::out_of_order:
    case Code::incomplete:
    case Code::wrong_checksum:
    case Code::invalid:
    case Code::flash:
    case Code::no_previous:
    case Code::worn:
      return store_text_of(code);
  }
  return "a code that this tool does not know; bring the tool up to date";
}

constexpr std::string_view text_of(Refusal refusal) {
  switch (refusal) {
    case Refusal::none:
      return "not refused";
    case Refusal::armed:
      return "only an idle drive can do that; disarm it first";
    case Refusal::not_armed:
      return "the drive is not armed";
    case Refusal::other_mode:
      return "the set point is for another mode than the drive is in";
    case Refusal::no_mode:
      return "this is not a mode that a drive can be commanded into";
    case Refusal::moving:
      return "the shaft moves; bring it to rest first";
    case Refusal::no_parameters:
      return "the drive has no parameters; flash a block first";
    case Refusal::no_excitation:
      return "the drive has no excitation";
    case Refusal::fault:
      return "the drive is in a fault; find its cause and clear it first";
    case Refusal::booting:
      return "the drive is starting";
    case Refusal::commissioning:
      return "the drive measures its motor; stop that, or wait for its end";
    case Refusal::no_stage:
      return "the drive has no three-phase power stage, or the stage gives no samples";
    case Refusal::not_commissioned:
      return "the motor of this drive was never measured; run flexspline commission";
  }
  return "a refusal that this tool does not know";
}

constexpr std::string_view name_of(Mode mode) {
  constexpr std::array<std::string_view, kModes> kNames{"boot",       "idle", "current", "velocity",     "position",
                                                        "excitation", "stop", "fault",   "commissioning"};
  return static_cast<std::size_t>(mode) < kNames.size() ? kNames[static_cast<std::size_t>(mode)] : "unknown";
}

constexpr std::string_view name_of(PairingState state) {
  constexpr std::array<std::string_view, kPairingStates> kNames{"not_stated", "none", "not_paired", "locked", "open"};
  return static_cast<std::size_t>(state) < kNames.size() ? kNames[static_cast<std::size_t>(state)] : "unknown";
}

// A fault's name and its cause, by the numbers of states.hpp.
struct FaultText {
  std::string_view name{};
  std::string_view reason{};
};
inline constexpr std::array<FaultText, kFaults> kFaultTexts{{
    {"none", "no fault"},
    {"motor_encoder_stale", "the motor's encoder gave no new sample"},
    {"output_encoder_stale", "the output's encoder gave no new sample"},
    {"analog_stale", "the converter gave no new samples"},
    {"motor_encoder_jump", "the motor's encoder moved by more counts in a tick than at twice the overspeed"},
    {"motor_encoder_stuck",
     "the motor's encoder shows no motion, though the torque changed by more than friction can hold, stays at its "
     "limit, "
     "or drove the shaft on a moment before: a line or the whole encoder is lost, or the shaft is blocked "
     "(stuck_torque, stuck_s)"},
    {"implausible_motion", "the motor's encoder shows an acceleration that no torque can give (acceleration)"},
    {"current_out_of_range", "the current's converter is at its rail: sensor or wire broken"},
    {"torque_out_of_range", "the torque's converter is at its rail: sensor or wire broken"},
    {"temperature_out_of_range", "the temperature's converter is at its rail: sensor or wire broken"},
    {"torque_stuck", "the torque sensor's reading never changed, not even by its noise (torque_same_s)"},
    {"current_mismatch",
     "the measured current is not the commanded one: amplifier or sensor broken (current_mismatch, mismatch_s)"},
    {"overcurrent", "the measured current is above its limit"},
    {"overspeed", "the motor turns faster than its limit"},
    {"overtemperature", "the drive is too hot"},
    {"host_lost", "the host sent no command (host_s)"},
    {"tick_overrun", "a control tick did not end before the next one was due"},
    {"watchdog", "the watchdog reset the drive: a part of the application had stopped reporting"},
    {"stop_failed", "the shaft did not come to rest in time (stop_s)"},
    {"following_error",
     "the motor stays behind its set point: it is blocked, overloaded or set points jump (following_error, "
     "following_velocity, following_s)"},
    {"output_encoder_stuck",
     "the motor turned and the output's encoder shows no motion: encoder, its line, coupling or gear broken "
     "(output_stuck)"},
    {"encoders_disagree",
     "the motor's and the output's encoder show motions that no gear between them allows: one lost its signal, counts "
     "the other way, a coupling slips, or the gear ratio is wrong (output_stuck)"},
    {"set_point_lost", "the host is there, but the stream of set points ended in motion (host_s)"},
    {"amplifier_fault", "the amplifier switched itself off: its overcurrent protection or its supply tripped"},
    {"crashed", "the drive was reset by itself: an exception (a failure of firmware or memory), or its crystal failed"},
}};
// Why a three-phase power stage switched itself off.
inline constexpr std::array<FaultText, kStageFaults> kStageFaultTexts{{
    {"none", "the amplifier switched itself off: its overcurrent protection or its supply tripped"},
    {"sensor_zero", "a current sensor's zero is out of range: sensor or wire broken, or a current flows"},
    {"bus_low", "the bus voltage is below its range: supply off, too weak or fuse blown"},
    {"bus_high",
     "the bus voltage is above its range: the motor gave back more than supply and brake resistor take, or the supply "
     "is wrong"},
    {"overcurrent",
     "a phase's current is above the power stage's limit: phases shorted, or a current loop that oscillates"},
    {"current_sum",
     "the phase currents do not add up to zero: a phase is shorted to ground, or a current sensor broken"},
    {"driver", "the gate driver reports a fault: a short, its supply, or a switch broken"},
    {"hot", "the power stage is too hot"},
    {"thermistor_open", "the power stage's thermistor is open: wire or part broken"},
    {"thermistor_shorted", "the power stage's thermistor is shorted"},
    {"phase_lost", "a phase carries no current: wire, connector or winding open"},
    {"voltage_residual",
     "the motor's voltages are not those of its currents and speed: phases shorted, the encoder shows a wrong angle, "
     "or "
     "another motor; run flexspline commission"},
}};
constexpr FaultText stage_fault_text(std::int32_t number) {
  return number >= 0 && number < static_cast<std::int32_t>(kStageFaults)
             ? kStageFaultTexts[static_cast<std::size_t>(number)]
             : FaultText{"unknown", "the power stage switched itself off for a reason that this tool does not know"};
}

constexpr FaultText fault_text(std::uint8_t number) {
  return number < kFaults ? kFaultTexts[number] : FaultText{"unknown", "a fault that this tool does not know"};
}
// With what its limit says about it; the name stays that of the fault.
constexpr FaultText fault_text(std::uint8_t number, std::int32_t limit) {
  const FaultText text = fault_text(number);
  const bool says_why = number == static_cast<std::uint8_t>(Fault::amplifier_fault) && limit != 0;
  return says_why ? FaultText{text.name, stage_fault_text(limit).reason} : text;
}

// The base of a channel's numbers, in 2^-27; or another meaning of its word.
enum class Base : std::uint8_t {
  word,
  turns,     // signed, of the motor or output
  fraction,  // of a turn, 2^-32; unsigned
  velocity,
  acceleration,
  output_velocity,
  torque,         // of the motor
  output_torque,  // through the flexspline
  current,
  temperature,
  torsion,
};
struct ChannelText {
  std::string_view name{};
  std::string_view unit{};
  Base base = Base::word;
};
inline constexpr std::array<ChannelText, kChannels> kChannelTexts{{
    {"state", "", Base::word},
    {"readings", "counts", Base::word},
    {"motor_turns", "turns", Base::turns},
    {"motor_fraction", "turns", Base::fraction},
    {"output_turns", "turns", Base::turns},
    {"output_fraction", "turns", Base::fraction},
    {"velocity", "rad/s", Base::velocity},
    {"acceleration", "rad/s^2", Base::acceleration},
    {"output_velocity", "rad/s", Base::output_velocity},
    {"torque", "N*m", Base::output_torque},
    {"current", "A", Base::current},
    {"temperature", "degC", Base::temperature},
    {"disturbance", "N*m", Base::torque},
    {"torsion", "rad", Base::torsion},
    {"set_turns", "turns", Base::turns},
    {"set_fraction", "turns", Base::fraction},
    {"set_velocity", "rad/s", Base::velocity},
    {"set_acceleration", "rad/s^2", Base::acceleration},
    {"feedforward_torque", "N*m", Base::torque},
    {"command_torque", "N*m", Base::torque},
    {"command_current", "A", Base::current},
}};
constexpr const ChannelText& text_of(Channel channel) {
  return kChannelTexts[static_cast<std::size_t>(channel)];
}

}  // namespace flexspline::protocol
