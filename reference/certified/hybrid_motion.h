#pragma once

#include <optional>

#include "reference/certified/certified_motion.h"
#include "reference/certified/decisions.h"
#include "reference/certified/moving_set.h"
#include "reference/certified/sensitivities.h"

/// @file
/// HybridMotion: one attempt, at one precision, to enclose a motion from event to event.

namespace ricochet::reference::certified {

/// Encloses the motion of a scene. Smooth pieces are Taylor steps; the first root of all event functions ends a piece;
/// impacts and modes after it are decided by signs. Errors of rounding and truncation are in the balls.
class HybridMotion {
 public:
  /// @param formulas  in terms of the `program`
  /// @param cut  decimal places: smaller velocities of coupled contacts are taken as zero where impacts accumulate, and
  ///             the grade is `computed`; 0: never
  HybridMotion(SceneFormulas formulas, SeriesProgram& program, const Options& options, const TimeLimit& limit,
               int cut = 0);

  /// Lets `sensitivities` follow the motion. They must outlive it.
  void follow(Sensitivities& sensitivities) { sensitivities_ = &sensitivities; }

  // Regions (borders.cpp), of scenes whose formulas bend or jump; motion_by_regions.h puts them together.

  /// Borders whose function is negative at the present state. @param but  those that are zero there
  /// @throws Undecided if another one may be zero
  std::vector<int> borders_left(const std::vector<int>& but);
  /// Begins at t = 0, where the functions of the borders `zero` vanish. @returns their signs just after
  /// @throws Undecided, Unsupported
  std::vector<Sign> begin_on_borders(const std::vector<int>& zero);
  /// Takes state, time and events of a motion that has left its region.
  void place_at(const HybridMotion& before);
  /// Continues it in this region, after place_at(). @throws Undecided, Unsupported
  void enter(HybridMotion& before);
  /// How run() ended before the end time: at a border.
  struct Exit {
    int border = -1;           ///< it is reached; -1: an impact has changed signs
    std::vector<int> changed;  ///< borders whose sign changes
  };
  bool has_advanced() const { return !t_.is_zero(); }
  const std::optional<Exit>& exit() const { return exit_; }  ///< Nothing at the end time.

  /// Runs to the end time or to a border. @throws Undecided, Unsupported, OutOfTime, with what is enclosed until then in result()
  void run();
  /// State, events, grade and statistics, with decimal numbers.
  CertifiedMotion result() const;
  /// Upper bound of log10 of all radii of the state and of the event times.
  double log10_radius() const;
  /// Whether the last impacts follow each other so fast that they seem to accumulate.
  bool impacts_accumulate() const;

 private:
  /// A step within which nothing happens, or which ends at events.
  struct Step {
    double h = 0;
    Ball end;                          ///< fraction of h
    std::vector<std::size_t> reached;  ///< event functions of the motion that vanish at the end, not to be told apart
    bool is_tied = false;              ///< they vanish at exactly the same time
    bool is_last = false;              ///< ends at the end time
    std::vector<int> grazing;          ///< contacts whose gap touches zero, taken for no impact
  };

  void run_to_end();
  void begin();
  bool leaves_region();
  void reach_border(int border);
  void change_contacts(const HybridMotion& before, std::vector<int>& slip_sign, std::vector<int>& hit);
  void strike_corner(HybridMotion& before, const std::vector<int>& hit);
  void assume(const std::string& what);
  void take_as_zero(const std::string& what);
  void refuse_sensitivities(const std::string& reason);
  void begin_motion();
  Step find_step();
  double shortest_flight() const;
  bool try_step(double h, Step& step, std::string& reason);
  bool find_events(double h, const Ball& end, Step& step, std::string& reason);
  void keep(const Step& step);
  void leave_room();
  void advance(const Step& step);
  std::string name_of_event(const EventFunction& event) const;

  void handle(const EventFunction& event);
  void keep_impact(std::vector<Ball> x, const ImpactOutcome& outcome, const std::string& contact);
  void pass_window(const std::vector<Ball>& box, const Ball& w, const Ball& event, const std::vector<Mode>& modes,
                   const std::string& kind, const std::string& contact);
  void record(const std::string& kind, const std::string& contact, const std::vector<Ball>& Lambda_n = {});

  // accumulation.cpp
  bool may_collapse(int contact) const;
  bool pass_accumulation(int contact, Mode last);
  struct Collapse;
  Mode mode_of_collapse(int contact, Mode last);
  void map_collapse(Collapse& collapse);
  std::vector<Ball> jumps_of_slip(const Collapse& collapse);
  std::vector<Ball> jumps_of_sticking(const Collapse& collapse);

  // accumulation_of_two.cpp
  struct PairCollapse;
  struct PairImpacts;
  bool may_collapse_with_another(int contact);
  std::optional<int> neighbour_of(int contact);
  bool set_pair(PairCollapse& pair);
  bool load_pair(PairCollapse& pair, const std::vector<const ModeMotion*>& motions);
  PairImpacts impacts_of_pair(const PairCollapse& pair, double least, int most) const;
  void map_pair(PairCollapse& pair, const Ball& duration, const std::array<Ball, 2>& most);
  bool map_rest_of_two(PairCollapse& pair, double small);
  template <class Map>
  bool enclose_pair(PairCollapse& pair, Map map);
  bool pass_accumulation_of_two(int contact, int neighbour);

  // plastic_accumulation.cpp
  bool map_plastic_pair(PairCollapse& pair);
  void pass_limit(const PairCollapse& pair, const std::string& contact);

  // group_collapse.cpp
  void pass_group_collapse(int contact);
  std::vector<int> group_of(int contact);
  bool comes_to_rest(const std::vector<int>& group);

  // slip_end_in_space.cpp
  struct LastSlip;
  bool pass_slip_end(int contact);
  void map_last_slip(LastSlip& last);

  // tied_impacts.cpp
  bool are_tied_impacts(const std::vector<std::size_t>& reached, double h);
  void handle_tied_impacts(const Step& step);
  void keep_symmetry(std::vector<Ball>& x, int i, int j);

  // slip_turn_in_space.cpp
  struct SlipTurn;
  bool pass_slip_turn(int contact, const Ball& s);
  void map_slip_turn(SlipTurn& turn);

  // simultaneous_impacts.cpp
  bool are_decoupled_impacts(const Step& step) const;
  void handle_decoupled_impacts(const Step& step);
  struct Window;
  Window window_of(const Step& step);
  Mode mode_after_impact(const std::vector<Ball>& x, const Ball& t, int contact, Mode impact);
  void map_window(Window& window);
  void require_impacts(const Window& window);

  SceneFormulas scene_;
  SeriesProgram& p_;
  const Options& options_;
  const TimeLimit& limit_;
  int cut_;  ///< decimal places, or 0
  TaylorStep taylor_;
  MovingSet set_;
  Decisions decisions_;
  ContactStates states_;
  Sensitivities* sensitivities_ = nullptr;
  ModeMotion motion_;
  bool has_begun_ = false;
  std::optional<Exit> exit_;
  Ball t_;
  int last_impact_ = 0;  ///< contact of the last impact
  CertifiedMotion result_;
  std::vector<Ball> event_times_;
};

}  // namespace ricochet::reference::certified
