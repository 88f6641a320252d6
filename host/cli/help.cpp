#include "host/cli/help.hpp"

#include <fmt/format.h>

#include <array>
#include <stdexcept>

namespace flexspline::cli {
namespace {

// A simulated drive, one of whose effects its base model lacks: data that every example can use.
constexpr std::string_view kMakeData = "flexspline-hil record --out demo-out --hide viscous_asymmetry";
constexpr std::string_view kIdentify =
    "flexspline identify demo-out --model demo-out/base-model.toml --out fitted.toml";
constexpr std::string_view kAdd =
    "flexspline add viscous_asymmetry --model demo-out/base-model.toml demo-out --out better.toml";

const std::array kHelp = {
    CommandHelp{"demo",
                "all steps on the embedded twin, with a hidden effect",
                "A simulated drive with one effect that the model does not know is recorded, identified and compared; "
                "the missing effect is diagnosed and added, and both models are compared on motions that the fit "
                "never saw. At the end the twin states what was hidden. report.html shows all of it with plots.",
                {"flexspline demo --hidden stribeck_gaussian --seed 7 --out demo-out"}},
    CommandHelp{
        "new",
        "first dataset.toml and base model from measurements",
        "Reads recordings as a logger left them (CSV, also of scopes and compressed by gzip; MAT; HDF5; NumPy; bags of "
        "ROS 1 and 2 and MCAP, by topic and field; logs of moteus), finds out which column is what from names, units "
        "and motion, and writes two files into a new folder: dataset.toml, which maps the columns to the names of the "
        "tool, and base-model.toml, with the effects that these signals can show. The measurements are not changed. "
        "What is guessed is printed, and written as a comment into the files; --map and the other options overrule "
        "it. A robot's log, with the position of the link together with the current of the motor, takes "
        "--position-side link --gear-ratio N. A single record is split into a part to fit and a part to verify. What "
        "cannot be finished is left as a draft, with the command to continue.",
        {kMakeData, "flexspline new --from demo-out --out project"}},
    CommandHelp{"check",
                "what is in the data: signals, rates, noise, excitation, findings",
                "Reads measurements and lists what each experiment holds: signals with their range, noise and smallest "
                "step, motion, reversals, a period if it repeats itself; then each problem and its remedy, "
                " what can be identified from these signals, and which filters would be used.",
                {kMakeData, "flexspline check demo-out"}},
    CommandHelp{
        "effects",
        "the catalogue of physical effects, or one of them explained",
        "Without a name: all effects with the torque balance they act on, their equation, usual size and where they "
        "show. With a name: what the effect is, where it comes from on a machine, what it is confused with and which "
        "experiment distinguishes them; and a drawn curve.",
        {"flexspline effects stribeck_gaussian"}},
    CommandHelp{
        "measure",
        "before any model: frequency response, noise floor, distortion, resonance",
        "Reports what measurements show of a drive without any model: the frequency response from the current to "
        "velocity, torque and torsion with its coherence and confidence band; resonances and anti-resonances with "
        "damping; the noise of each signal, from what differs between the periods of an excitation; odd and even "
        "nonlinear distortion, from the lines that a linear drive would leave empty. What the given motions cannot "
        "show is printed, with the motion that would show it. Best is an odd random-phase multisine with some odd "
        "lines left out, repeated six times.",
        {kMakeData, "flexspline measure demo-out"}},
    CommandHelp{
        "identify",
        "estimates the parameters of a model",
        "Estimates every parameter that the model does not fix, from the experiments of role fit: for each experiment "
        "alone, with average and spread, and for all together with 95 % intervals. A spread above 30 % is flagged: "
        "the parameter is not reliable, or an effect is missing. \"excited\" is the share of a parameter's effect on "
        "the data that no other parameter can explain. With --out the model is written with the values; its comments "
        "and layout stay. --method iv or oe is for velocities so noisy that least squares is biased towards "
        "zero; --intervals profile or bootstrap for parameters whose uncertainty is not symmetric; --supply for "
        "a parameter that is known from another source, such as an inertia where the torque constant is not known "
        "either. --report writes a page with plots for a browser or a printer.",
        {kMakeData, kIdentify,
         "flexspline identify demo-out --model demo-out/base-model.toml --method oe --supply inertia.inertia=1.04e-4"}},
    CommandHelp{
        "simulate",
        "runs a model on the measured input",
        "Runs the model from the measured effort alone, experiment by experiment, and writes the motion and torque "
        "that it predicts as CSV files, with a dataset.toml so that every other command reads them.",
        {kMakeData, kIdentify, "flexspline simulate --model fitted.toml demo-out --out simulated"}},
    CommandHelp{
        "compare",
        "model against measurement, by experiment, signal and region",
        "Compares in both directions: the torque that the model needs for the measured motion (the balances), and the "
        "motion that it predicts from the measured torque (free run). Errors are shown with the noise of the "
        "measurement where that is known; the regions with the largest excess over it are named. --limit sets a "
        "limit: exit code 1 where a signal's error is above it. --beside fits a linear black box (FIR or ARX) to the "
        "same signals, on the experiments that are not held out, and shows what error its many parameters reach. "
        "--report writes a page with plots of all of it.",
        {kMakeData, kIdentify, "flexspline compare --model fitted.toml demo-out --beside arx:4,4,1"}},
    CommandHelp{
        "diagnose",
        "which physical effect is missing from a model, or that none is",
        "Fits the model, finds where its error is large, tries every effect of the catalogue against data left out of "
        "the fit, and names the one that is missing; or reports that none is, or that these data cannot show it, and "
        "which experiment would. The model needs no values. With --auto it continues with the effect added until "
        "nothing more is found. --report writes a page with plots: where the model fails, and what is missing.",
        {kMakeData, "flexspline diagnose --model demo-out/base-model.toml demo-out"}},
    CommandHelp{
        "add",
        "adds an effect to a model and refits it, with the error before and after",
        "Adds an effect of the catalogue, re-estimates all parameters and reports what that does to the error, on the "
        "data that were fitted and on those held out. table_effect:SIGNAL learns a curve over a signal of your "
        "choice, as smooth as cross-validation chooses, where no effect of the catalogue fits; expression_effect fits "
        "a formula of your own. Comments and layout of the model file stay; its history gets a line. --report writes "
        "a page with plots, with the error before and after.",
        {kMakeData, kAdd,
         "flexspline add expression_effect --formula 'a*abs(velocity)' --parameter a:N*m*s/rad --model "
         "demo-out/base-model.toml demo-out --out better.toml"}},
    CommandHelp{
        "remove",
        "takes an effect out of a model and refits it, and shows what that costs",
        "Takes an effect out, by its id or its type, re-estimates the rest and reports what that does to the error, on "
        "the data that were fitted and on those held out.",
        {kMakeData, kAdd, "flexspline remove coulomb_asymmetry --model better.toml demo-out --out smaller.toml"}},
    CommandHelp{
        "sensitivity",
        "what the model depends on: each effect left out or scaled in turn",
        "Leaves each effect of the model out in turn, and scales the stiffness to a tenth and to ten times (and with "
        "--scale any parameter), everything else as it is. Each of these models is evaluated as compare does: the "
        "torque balances, and the free run with its amplitude and phase at the frequency of the motion. The largest "
        "growth of an error comes first. An effect that hardly changes any error need not be modelled, or these "
        "motions do not show it. With --refit the other parameters are re-estimated first: the error that they cannot "
        "compensate is what the effect is needed for.",
        {kMakeData, kIdentify,
         "flexspline sensitivity --model fitted.toml demo-out --scale viscous_friction.coefficient=1.5"}},
    CommandHelp{
        "pack",
        "makes the parameter block of a drive from a model, with its proof",
        "Turns a model into the bytes that a drive computes with: bases from the ratings in [drive], coefficients as "
        "integers, and a checksum. Proves that no number can leave its range whatever the drive measures within twice "
        "its ratings, bounds for each effect and for the sum how far the drive can be from the equations, and compares "
        "the block with double along a hundred thousand samples of the whole envelope. A model that does not fit, "
        "whose error along the samples is above --bound, or whose error has no bound that can be proven (unless "
        "--measured goes without one), is refused with the reason (exit code 1 for the error, 2 for all else). The "
        "model's parameters go into the block too, for unpack. With --drive the block has "
        "all that a drive needs: loops (50 Hz velocity with integral, 10 Hz position), limits, sensors, feedforward "
        "and observers, as a TOML file states them (host/deployment/README.md has the keys) and else as the ratings "
        "and the model suggest. Without it a block is good to simulate with; a drive refuses it.",
        {kMakeData, kIdentify, "flexspline pack --model fitted.toml --out drive.block --encoder-counts 4096",
         "printf 'format = \"flexspline-drive/1\"\\n[output_encoder]\\ncounts = 65536\\n' | tee drive.toml",
         "flexspline pack --model fitted.toml --drive drive.toml --tick-hz 20000 --encoder-counts 4096 --out "
         "full.block"}},
    CommandHelp{"unpack",
                "checks a parameter block and prints its contents",
                "Checks a block with the drive's own code, prints its contents in SI, and with --out writes the "
                "model that it was made from. A damaged block is refused: which entry and field, and why.",
                {kMakeData, kIdentify, "flexspline pack --model fitted.toml --out drive.block",
                 "flexspline unpack drive.block --out again.toml"}},
    CommandHelp{
        "export",
        "the model for other tools: C header, tables, MuJoCo, URDF",
        "c: one C99 header with all the model's effects, those with memory too, to be called once a sample; its "
        "numbers are those of simulate, to rounding. csv: a folder with the parameters, the friction over speed, the "
        "transmission's loop, and the curve of each effect that depends on one signal. mujoco, urdf: a joint with "
        "armature, the linear law nearest to the friction, and stiffness; what a joint cannot hold is written in a "
        "comment. --protocol-header writes what travels between host and drive, for programs of your own: message "
        "kinds, codes, channels, layouts, and the parameter block with the places of its fields.",
        {kMakeData, kIdentify, "flexspline export --protocol-header --out flexspline_protocol.h",
         "flexspline export --model fitted.toml --as c --out drive_model.h",
         "flexspline export --model fitted.toml --as csv --out tables"}},
    CommandHelp{
        "plan",
        "designs the motion that distinguishes two effects, or that determines the parameters",
        "Rehearses some thirty motions with the model, within the limits of the drive: triangles slow and fast, sines, "
        "saw-teeth, multisines, chirps, steps of speed, a locked output, a constant load, two temperatures, the "
        "drive off. With --separate, motions are chosen that distinguish two effects best: by the part of one "
        "effect's torque that the model with the other cannot reproduce, over the noise. Without it, motions that "
        "determine all parameters best. Measurements, where given, give the noise, the sizes of the effects and what "
        "need not be recorded again. If no motion distinguishes two effects, the answer says so. The plan is a TOML "
        "file that flexspline-hil record --plan runs on the twin.",
        {kMakeData, kIdentify,
         "flexspline plan --separate stribeck_gaussian,load_dependent_friction --model fitted.toml --out "
         "plan.toml"}},
    CommandHelp{
        "drives",
        "the drives that can be reached, and what each is",
        "Lists the drives on USB with serial number, firmware, effects of the image and state; one that cannot be "
        "opened with the reason and what to do. What is behind a serial port or a socket is found with --also.",
        {"flexspline drives --also twin"}},
    CommandHelp{
        "flash",
        "puts a model, a parameter block or new firmware on a drive",
        "Packs the model for this drive (its tick rate, its effects), or takes a block as it is, and prints what that "
        "changes against the block in use, parameter by parameter. The drive keeps the old block until the new one "
        "has arrived completely and has passed its checks, and keeps it for restore; it refuses while it is armed. "
        "The gain of the model at slow reversals is predicted from its values and their uncertainty and printed "
        "first. On a terminal it asks first; without one, or with --yes, it does not. --firmware takes an image of "
        "flexspline image to a drive on USB: it goes to its boot loader, gets the image and tries it; an image that "
        "fails is rolled back (exit code 1). Images for other boards, damaged ones and, without --older, older ones "
        "are refused before anything is sent.",
        {kMakeData, kIdentify, "flexspline flash --drive twin --model fitted.toml --yes"}},
    CommandHelp{
        "image",
        "makes a firmware image of a program",
        "Puts before a program (BIN file) the header that boot loader and flash --firmware check: length, checksum, "
        "board, version, security counter and signature. The program has to be linked to begin 512 bytes behind its "
        "slot. Without --key the image is signed with the development key, which is public: boot loaders that were "
        "built without a key of their own take it. --dfu adds the suffix that dfu-util looks for. flexspline-hil "
        "image makes images for the twin.",
        {"echo a program | tee program.bin",
         "flexspline image --program program.bin --board stm32f405-dac --version 1.2 --out firmware.image"}},
    CommandHelp{
        "sign",
        "signs a firmware image",
        "Signs an image (Ed25519) with the secret key of a file of flexspline key --new, for boot loaders that were "
        "built with its public key; a signature that the image has is replaced. --counter raises the security "
        "counter: once such an image was confirmed by a drive, the drive refuses all with a smaller one.",
        {"echo a program | tee program.bin",
         "flexspline image --program program.bin --board stm32f405-dac --version 1.2 --unsigned --out plain.image",
         "flexspline key --new product.key",
         "flexspline sign --image plain.image --key product.key --counter 1 --out firmware.image"}},
    CommandHelp{
        "key",
        "makes and shows keys that firmware is signed with",
        "--new makes a pair of Ed25519 keys and writes both into a file that its owner alone may read (mode 0600); "
        "an existing file is never overwritten. Keep a copy: a drive whose boot loader has this public key takes "
        "images signed by it and no others. --show prints the public key of a file, for the build of the boot "
        "loader; it prints nothing secret.",
        {"flexspline key --new product.key", "flexspline key --show product.key"}},
    CommandHelp{
        "backup",
        "saves the parameter block of a drive",
        "Reads the active block, or with --previous the one before it, into a file that flash --block and unpack "
        "take.",
        {"flexspline backup --drive twin --out drive.block"}},
    CommandHelp{
        "restore",
        "goes back to the parameter block before",
        "Makes the block before the active one active, and prints first what that changes. A second restore goes "
        "forward again. Nothing is erased; a power cut leaves one or the other. With --factory-reset both blocks are "
        "erased: the drive has no parameters from its next start on, until another block is flashed.",
        {kMakeData, kIdentify, "flexspline flash --drive twin --model fitted.toml --yes",
         "flexspline restore --drive twin --yes"}},
    CommandHelp{
        "home",
        "sets the motor position of a drive",
        "Incremental encoders do not know their absolute position: until it is set, or an index pulse came, a drive "
        "leaves out of its compensation what depends on the angle, and limits of position do not hold. Bring the "
        "shaft to a mark, at rest and not armed, and give the motor's angle there, as the model's data count it. "
        "Absolute encoders at motor and output need none of this. The reference is lost when the power goes, or when "
        "a fault reports that counts were lost. Without --position-rad it prints what the drive knows.",
        {"flexspline home --drive twin", "flexspline home --drive twin --position-rad 0"}},
    CommandHelp{
        "monitor",
        "live signals of a drive",
        "Shows mode, faults and signals as they are; on a terminal with a curve of the last seconds behind each, else "
        "a line at a time. --json writes the samples at the end. It only reads: nothing is armed. --residual-map "
        "shows where over velocity and motor angle the model on the drive fails, and how significant that is: the "
        "drive fills the map while feedforward of its model is on (record --compensate); the first call starts the "
        "count.",
        {"flexspline monitor --drive twin --seconds 0.5", "flexspline monitor --drive twin --residual-map"}},
    CommandHelp{
        "record",
        "runs the motions of a plan on a drive and saves the measurements",
        "Runs each motion of a plan on the drive itself (currents and velocities as its excitation, positions by its "
        "trajectory, from the present position of the shaft), at most at the plan's limits and the drive's, and "
        "writes a data set: a CSV file for each run with the drive's identity and its block's hash, and dataset.toml. "
        "Frames that got lost are counted and named in the file. Ctrl-C, a limit or a fault brings the drive to rest; "
        "what was finished before is kept (exit code 1). Runs that need a person (a locked output, a load) ask on a "
        "terminal, and without one need --yes.",
        {kMakeData, kIdentify,
         "flexspline plan --model fitted.toml --run-s 2 --motions 1 --without off,locked,load,temperature --out "
         "plan.toml",
         "flexspline record --drive twin --plan plan.toml --out recorded",
         "flexspline record --drive twin --plan report-friction --runs 50-1-10 --out recorded-as-in-the-report"}},
    CommandHelp{
        "twin",
        "a virtual drive: a plant, its sensors and the firmware",
        "Runs until Ctrl-C and prints the address for --drive: a socket (tcp:127.0.0.1:PORT/TOKEN), or with --usbip a "
        "USB device, which Linux takes for a real one once it is attached: sudo modprobe vhci-hcd; sudo usbip "
        "--tcp-port PORT attach -r 127.0.0.1 -b 1-1. --drive twin starts one of its own and needs none of this. "
        "flexspline-hil twin, which this starts, has more options: hidden effects, faults, a serial line. --json "
        "writes where it is once it listens.",
        {"flexspline twin --seconds 0.5"}},
    CommandHelp{
        "hil",
        "a drive in closed loop, with and without compensation",
        "Runs the drive's own firmware on a simulated drive along a motion, with the same loops each time: without "
        "compensation, with a model, and with the model that an effect was added to (--base and --model). Reports the "
        "tracking error of the output, the current, and limit cycles at rest; and what was predicted from the "
        "model and the uncertainty of its parameters alone. A scenario is a name (flexspline-hil scenarios lists "
        "them) or a file with motion, drive, surroundings and faults. Without --model the manufacturer's values are "
        "used. --processor runs the controller as the image of an ARM processor.",
        {"flexspline hil --scenario slow-reversals --hide stribeck_gaussian --seconds 4"}},
    CommandHelp{
        "workbench",
        "all steps with the mouse: a page in the browser of this machine",
        "Serves a page on 127.0.0.1 and opens it: how good the model is, where it fails, what is missing, and the "
        "error with that added; steps can be undone and compared. Without --model it begins as "
        "flexspline new does: drop recordings on the page (or give them as DATA), look at the signals, choose which "
        "column is which, type gear ratio and torque constant, and a first model is identified. Models, reports and "
        "blocks are saved into the model's folder (without --model into this one), run in closed loop on a simulated "
        "drive (--plant), and flashed to a drive or the twin, whose signals and residual map are shown. The address "
        "has a token in it: requests without it are refused. Runs until Ctrl-C; --json writes the address once it "
        "listens.",
        {"flexspline workbench --no-open --seconds 0.5", kMakeData,
         "flexspline workbench demo-out --model demo-out/base-model.toml --no-open --seconds 0.5"}},
    CommandHelp{
        "fleet",
        "many drives: one command a drive, then which of them differs from its siblings",
        "run identifies a drive (with --diagnose diagnoses it, too) and writes fleet-result.json next to its "
        "measurements; if that exists already, of the same files and the same build, nothing is done, so the "
        "command can be repeated after a stop. It is for a scheduler: parallel flexspline fleet run {} ::: "
        "drives/*, or in a Slurm array job: all=(drives/*); flexspline fleet run \"${all[$SLURM_ARRAY_TASK_ID]}\". "
        "merge reads the results, reports how each parameter and each error is distributed over the drives, and names "
        "drives that are further off than their siblings' scatter explains; at least five drives are needed.",
        {"flexspline-hil record --out drives/one --seed 1", "flexspline fleet run drives/one",
         "flexspline fleet merge drives"}},
    CommandHelp{"completion",
                "a script by which a shell completes commands, options and effects",
                "Prints the script for bash, zsh or fish, made from the options that --help shows. bash: flexspline "
                "completion bash > /etc/bash_completion.d/flexspline; zsh: into a folder of $fpath as _flexspline; "
                "fish: ~/.config/fish/completions/flexspline.fish. An installed package brings all three.",
                {"flexspline completion bash"}},
    CommandHelp{"man",
                "this help as a man page",
                "Prints the page in roff, made from the texts and options that --help shows: flexspline man > "
                "flexspline.1, then man -l flexspline.1. An installed package brings it: man flexspline.",
                {"flexspline man"}},
};

}  // namespace

const CommandHelp& help_of(std::string_view command) {
  for (const CommandHelp& help : kHelp)
    if (help.name == command) return help;
  throw std::logic_error(fmt::format("no help is written for {}", command));
}

std::string example_text(const CommandHelp& help) {
  std::string text = "Example:";
  for (const std::string_view line : help.examples) text += fmt::format("\n  {}", line);
  return text;
}

}  // namespace flexspline::cli
