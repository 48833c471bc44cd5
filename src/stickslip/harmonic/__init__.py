"""The periodic problem: condensed dynamic stiffness, contact forces in the frequency domain, residual and Jacobian."""
