// Siconos: the rig as a Lagrangian system with two relays, Moreau-Jean, theta = 0.5.
// argv: volts, step (s), seconds, sample interval (s). Prints wall seconds, then omega_l.
#include <SiconosKernel.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

// Equations (6) and (8).
static const double KM = 3.5693, JU = 0.4765, TSU = 0.3212, DTSU = 0.0095, BU = 1.9833,
                    DBU = -0.0167, JL = 0.0326, KTHETA = 0.078, TSL = 0.0094, T1 = 0.0826,
                    T2 = -0.291, BETA1 = 6.3598, BETA2 = 0.0768, BL = 0.0042;

// Everything but the set-valued part, as internal forces: they stand on the left side.
extern "C" void inner(double, unsigned int, double* q, double* v, double* f, unsigned int,
                      double* z) {
  const double string = KTHETA * (q[0] - q[1]);
  f[0] = string + DTSU + BU * v[0] + DBU * std::fabs(v[0]) - KM * z[0];
  f[1] = -string + T1 * std::tanh(0.5 * BETA1 * v[1]) + T2 * std::tanh(0.5 * BETA2 * v[1]) +
         BL * v[1];
}

extern "C" void inner_by_position(double, unsigned int, double*, double*, double* j, unsigned int,
                                  double*) {
  j[0] = j[3] = KTHETA;
  j[1] = j[2] = -KTHETA;
}

extern "C" void inner_by_velocity(double, unsigned int, double*, double* v, double* j,
                                  unsigned int, double*) {
  const double s1 = std::tanh(0.5 * BETA1 * v[1]), s2 = std::tanh(0.5 * BETA2 * v[1]);
  j[0] = BU + (v[0] < 0.0 ? -DBU : DBU);
  j[1] = j[2] = 0.0;
  j[3] = 0.5 * (T1 * BETA1 * (1.0 - s1 * s1) + T2 * BETA2 * (1.0 - s2 * s2)) + BL;
}

int main(int, char** argv) {
  const double volts = atof(argv[1]), h = atof(argv[2]), seconds = atof(argv[3]);
  const long every = std::lround(atof(argv[4]) / h), steps = std::lround(seconds / h);
  SP::SiconosVector q(new SiconosVector(2)), v(new SiconosVector(2)), z(new SiconosVector(1));
  SP::SiconosMatrix mass(new SimpleMatrix(2, 2));
  q->zero();
  v->zero();
  (*z)(0) = volts;
  mass->zero();
  (*mass)(0, 0) = JU;
  (*mass)(1, 1) = JL;
  SP::LagrangianDS rig(new LagrangianDS(q, v, mass));
  rig->setzPtr(z);
  rig->setComputeFIntFunction(&inner);
  rig->setComputeJacobianFIntqFunction(&inner_by_position);
  rig->setComputeJacobianFIntqDotFunction(&inner_by_velocity);

  SP::NonSmoothDynamicalSystem model(new NonSmoothDynamicalSystem(0.0, seconds + 1.0));
  model->insertDynamicalSystem(rig);
  const double hold[2] = {TSU, TSL};
  for (int disc = 0; disc < 2; ++disc) {
    SP::SimpleMatrix pick(new SimpleMatrix(1, 2));
    pick->zero();
    (*pick)(0, disc) = 1.0;
    // Time stepping works with impulses: the relay's levels are torque times step.
    SP::NonSmoothLaw law(new RelayNSL(1, -hold[disc] * h, hold[disc] * h));
    SP::Relation relation(new LagrangianLinearTIR(pick));
    SP::Interaction relay(new Interaction(law, relation));
    model->link(relay, rig);
  }
  SP::MoreauJeanOSI scheme(new MoreauJeanOSI(0.5));
  // A relay acts always, whatever the angle that stands in for a contact's gap.
  scheme->setConstraintActivationThreshold(1e300);
  SP::TimeDiscretisation clock(new TimeDiscretisation(0.0, h));
  SP::OneStepNSProblem problem(new Relay(SICONOS_RELAY_LEMKE));
  SP::TimeStepping run(new TimeStepping(model, clock, scheme, problem));
  run->setNewtonTolerance(1e-10);
  run->setNewtonMaxIteration(20);

  std::vector<double> out{0.0};
  const auto start = std::chrono::steady_clock::now();
  for (long i = 1; i <= steps; ++i) {
    run->computeOneStep();
    if (i % every == 0) out.push_back((*rig->velocity())(1));
    run->nextStep();
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  std::printf("%.9g\n", wall.count());
  for (double w : out) std::printf("%.17g\n", w);
}
