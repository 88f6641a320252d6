// The same free run as host/physics/simulation, written as one would write it in C for one fixed model.
#pragma once

// Motor with Coulomb and viscous friction, linear spring, damping c |v|^alpha s(v), load with Coulomb and viscous
// friction. SI units; spring, damping and load as seen from the output.
struct PlainDrive {
  double gear_ratio;
  double torque_constant;  // N m/A
  double inertia;          // kg m^2, motor side
  double viscous;          // N m s/rad
  double coulomb;          // N m
  double stiffness;        // N m/rad
  double damping;          // N m at 1 rad/s of torsion rate
  double exponent;         // (0, 1]
  double output_inertia;   // kg m^2; not read where the output is locked
  double output_viscous;
  double output_coulomb;
  int locked;
};

struct PlainState {
  double motor_position;
  double motor_velocity;
  double output_position;
  double output_velocity;
};

// Where the results go, `count` numbers each.
struct PlainTrace {
  double* motor_position;
  double* motor_velocity;
  double* output_position;
  double* output_velocity;
  double* torque;
};

// Runs `drive` from `start` on `count` samples of current (A), straight between samples that are `sample_s` apart,
// each of which is divided into `steps` equal steps.
void plain_c_loop(const PlainDrive* drive, PlainState start, const double* current, long count, double sample_s,
                  int steps, PlainTrace trace);
