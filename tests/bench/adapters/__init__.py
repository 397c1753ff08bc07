"""One module per peer; each is imported only where the peer is installed."""
