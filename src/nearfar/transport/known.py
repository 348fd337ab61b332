"""Transports that are known exactly: as matrices, or as operators where these are too large."""

from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator

KnownTransport = ExactTransport | ExactOperator
