"""The drill: causes every fault that Volley claims to survive, and measures the reaction against its bound."""
