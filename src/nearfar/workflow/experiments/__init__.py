"""The paper's experiments, on simulated scenes: what its figures and numbers are made of."""
