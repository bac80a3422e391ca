"""The decentralised filter: nodes that each own a part of the states, and an exchange that carries their words.

N nodes own x_i, P_ii and a share of the P_ij. A step is a fixed sequence of *rounds*; in a round each node may send a message,
and gets what the others sent. With L measurements due the rounds are

    1 .. L   a measurement: who holds entries of P forms M = P H' from them; its owner forms the innovation nu and S, judges it,
             and sends nu and S^-1; each node updates what it holds
    L + 1    each node sends x_i and its share of P, so that all nodes begin the next step with the whole of both

and a round more for each measurement that reads states of other nodes, whose owner needs M before it can form S. Between rounds
each node works alone, on what it holds: T_i = sum_a Phi_ia P_a, its blocks P_ij = T_i Phi_j' + Q_ij.

Successive orthogonalisation. With nu, S, M formed anew from the x and P that the measurements before left, the stages are the
block factorisation S = L D L' of the joint innovation covariance: e = L^-1 nu, cov e = D, so that x + M S^-1 nu and P - M S^-1 M'
are sums over the stages, the global filter exactly, for any partition and order (M. F. Hassan, G. Salut, M. G. Singh, A. Titli,
"A decentralized computational algorithm for the global Kalman filter", IEEE Trans. Autom. Control 23 (1978) 262).

`shares` says who holds what, `routes` who forms and sends what of M, `noise` what is done where noises of two nodes are
correlated, `node` is the program of a node, `separate_nodes` has those of suboptimal forms, `exchange` carries messages, `ledger`
counts them, `scan` is the recursion.
"""
