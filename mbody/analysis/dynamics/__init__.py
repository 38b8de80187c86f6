"""Forward dynamics: free motion over time, events, impacts, release of drivers."""
