#pragma once

#include <string>
#include <vector>

/// @file
/// Reference solutions that the Test Set for Initial Value Problem Solvers (Mazzia, Magherini, release 2.4, 2008)
/// publishes, beside what is proven.

namespace ricochet {

/// A scene of tests/data, and its final state.
struct PublishedReference {
  std::string file;
  /// By an extrapolation method (Gragg, Bulirsch, Stoer) with 34 digits in Python, which shares no code with this
  /// repository. 21 digits; proofs contain these numbers, rounded.
  std::vector<std::string> q, v;
  std::vector<double> published_q, published_v;  ///< as in the test set
  double largest_error = 0;                      ///< of the published numbers, rounded up
  double largest_error_in_q = 0;                 ///< of the published positions
};

inline const std::vector<PublishedReference>& published_references() {
  static const std::vector<PublishedReference> list = {
      // Published by PSIDE with tolerances of 1e-14 on a Cray C90. The first angle is wrong from the 11th digit on.
      {.file = "squeezing_mechanism",
       .q = {"15.8107711951537070971", "-15.7563710584118394697", "0.0408222401196458048583", "-0.53473011634207959377",
             "0.524409965879954069372", "0.53473011634207959377", "1.04808074104193787307"},
       .v = {"1139.9203022591060642", "-1424.3792951775400732", "11.0329119106185937453", "19.2933741050320408316",
             "0.573569914829502453818", "-19.2933741050320408316", "0.323179149249130874991"},
       .published_q = {15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
                       0.5244099658805304, 0.5347301163226948, 1.048080741042263},
       .published_v = {1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
                       -19.29337464421385, 0.3231791658026955},
       .largest_error = 5.4e-7,
       .largest_error_in_q = 1.5e-9},
      {.file = "car_axis",
       .q = {"0.0493455784275240921315", "0.496989460230008106763", "1.04174252488542611519",
             "0.373911027265365819358"},
       .v = {"-0.0770583684035920842839", "0.00744686659206841649141", "0.0175568157535417366298",
             "0.770341043779601063121"},
       .published_q = {0.04934557842755629, 0.4969894602303324, 1.041742524885400, 0.3739110272652214},
       .published_v = {-0.07705836840321485, 0.007446866596327776, 0.01755681574942899, 0.7703410437794031},
       .largest_error = 4.3e-12,
       .largest_error_in_q = 3.3e-13}};
  return list;
}

}  // namespace ricochet
